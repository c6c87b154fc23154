//! A shared library with the five functions of `stickslip_module.h`, called one after the other by whoever owns it.
//!
//! It is somebody's code and does what it likes in the process that opens it: who does not trust it opens it in a process
//! of its own.

#![expect(unsafe_code, reason = "functions of a library are called by their addresses, and hand out pointers")]

use std::ffi::{CStr, c_char, c_void};
use std::path::Path;

use libloading::Library;

/// Version of the functions, as the header says it.
pub const MODULE_ABI: u32 = 1;
/// More parameters than this are a mistake.
pub const MOST_PARAMETERS: usize = 4096;

/// Why a library is no module.
#[derive(Debug, thiserror::Error)]
pub enum ModuleError {
    /// The system cannot open it.
    #[error("it cannot be opened ({0}). Compile it for this machine, as a shared library (cc -shared -fPIC)")]
    Open(String),
    /// A function is not in it.
    #[error(
        "it has no function {0}. Include stickslip_module.h and define all five; in C++ the header makes them extern \"C\""
    )]
    Function(&'static str),
    /// It tells nothing of itself.
    #[error("stickslip_describe returns NULL. Return the address of a static stickslip_description")]
    NoDescription,
    /// It is of another version of the header.
    #[error(
        "its functions are of version {0}, version 1 is known. Compile it with the stickslip_module.h of this version"
    )]
    Abi(u32),
    /// It has no name, or no parameters where it says that it has some.
    #[error("{0} is NULL or too many in its description. Fill in all of it")]
    Description(&'static str),
}

/// A parameter as the library describes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModuleParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// What it is.
    pub help: String,
    /// Smallest value.
    pub minimum: f64,
    /// Largest value.
    pub maximum: f64,
    /// Value unless another is given.
    pub initial: f64,
    /// Whether it is taken when a controller begins, and not later.
    pub fixed: bool,
}

/// What is read in a sample, in the order of the header.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModuleSample {
    /// Since its begin [s].
    pub time: f64,
    /// Wanted angle [rad].
    pub reference_position: f64,
    /// Its first derivative [rad/s].
    pub reference_velocity: f64,
    /// Its second derivative [rad/s²].
    pub reference_acceleration: f64,
    /// By the encoder, unwrapped [rad].
    pub measured_angle: f64,
    /// Of the motor, by the tacho [rad/s].
    pub measured_velocity: f64,
    /// Of the screw, by the observer of the bench [rad/s]; 0 for a controller, as all that follows.
    pub estimated_velocity: f64,
    /// Of the load motor by its current, against positive motion [N m].
    pub measured_load_torque: f64,
    /// Asked of the drive in the tick before [N m].
    pub commanded_torque: f64,
}

#[repr(C)]
struct RawParameter {
    name: *const c_char,
    unit: *const c_char,
    help: *const c_char,
    minimum: f64,
    maximum: f64,
    initial: f64,
}

#[repr(C)]
struct RawDescription {
    abi: u32,
    parameter_count: u32,
    name: *const c_char,
    parameters: *const RawParameter,
}

type Describe = unsafe extern "C" fn() -> *const RawDescription;
type Begin = unsafe extern "C" fn(f64, f64, *const f64) -> *mut c_void;
type Set = unsafe extern "C" fn(*mut c_void, *const f64) -> i32;
type Step = unsafe extern "C" fn(*mut c_void, *const ModuleSample, *mut f64) -> i32;
type End = unsafe extern "C" fn(*mut c_void);

/// A library that is open, with one controller at most.
pub struct Module {
    name: String,
    parameters: Vec<ModuleParameter>,
    begin: Begin,
    set: Set,
    step: Step,
    end: End,
    controller: *mut c_void,
    /// Open as long as its functions can be called.
    _library: Library,
}

// SAFETY: the header admits any thread, one at a time; whoever owns the module is the only one that calls.
unsafe impl Send for Module {}

impl Module {
    /// Opens a library and reads what it says of itself.
    ///
    /// # Errors
    /// [`ModuleError`].
    pub fn open(path: &Path) -> Result<Self, ModuleError> {
        // A name without a folder would be searched for among the system's libraries.
        let path = path.canonicalize().map_err(|error| ModuleError::Open(error.to_string()))?;
        // SAFETY: what the library does when it is opened is its own: the caller was told.
        let library = unsafe { Library::new(path) }.map_err(|error| ModuleError::Open(error.to_string()))?;
        // SAFETY: the types are those of the header, which is what a library with these names promises.
        let (describe, begin, set, step, end) = unsafe {
            (
                function::<Describe>(&library, "stickslip_describe")?,
                function::<Begin>(&library, "stickslip_begin")?,
                function::<Set>(&library, "stickslip_set")?,
                function::<Step>(&library, "stickslip_step")?,
                function::<End>(&library, "stickslip_end")?,
            )
        };
        // SAFETY: it may be called before everything else; what it returns lives as long as the library. Beyond its
        // first number nothing is read of another version.
        let (name, parameters) = unsafe { described(describe())? };
        let controller = std::ptr::null_mut();
        Ok(Module { name, parameters, begin, set, step, end, controller, _library: library })
    }

    /// What the library is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its parameters, as it describes them.
    pub fn parameters(&self) -> &[ModuleParameter] {
        &self.parameters
    }

    /// Begins a controller at rest, and ends the one before; whether the library takes these numbers. There must be as
    /// many values as it has parameters.
    pub fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> bool {
        assert_eq!(values.len(), self.parameters.len(), "a value of each parameter");
        self.end();
        // SAFETY: as many values as parameters, which live through the call.
        self.controller = unsafe { (self.begin)(sample_time, torque_limit, values.as_ptr()) };
        !self.controller.is_null()
    }

    /// Gives it other values: what its function returns.
    pub fn set(&mut self, values: &[f64]) -> i32 {
        assert_eq!(values.len(), self.parameters.len(), "a value of each parameter");
        if self.controller.is_null() {
            return 0;
        }
        // SAFETY: a controller that has begun and not ended; as many values as parameters.
        unsafe { (self.set)(self.controller, values.as_ptr()) }
    }

    /// One sample: the torque [N m], or what its function returned instead of 0; -1 where no controller has begun.
    ///
    /// # Errors
    /// What the function returned.
    pub fn step(&mut self, sample: &ModuleSample) -> Result<f64, i32> {
        if self.controller.is_null() {
            return Err(-1);
        }
        let mut torque = f64::NAN;
        // SAFETY: a controller that has begun and not ended; both pointers are of this frame.
        match unsafe { (self.step)(self.controller, sample, &mut torque) } {
            0 => Ok(torque),
            code => Err(code),
        }
    }

    fn end(&mut self) {
        let controller = std::mem::replace(&mut self.controller, std::ptr::null_mut());
        if !controller.is_null() {
            // SAFETY: it has begun, and nobody has its address any more.
            unsafe { (self.end)(controller) }
        }
    }
}

impl Drop for Module {
    fn drop(&mut self) {
        self.end();
    }
}

/// The function of this name.
///
/// # Safety
/// It must be of this type.
unsafe fn function<F: Copy>(library: &Library, name: &'static str) -> Result<F, ModuleError> {
    // SAFETY: the caller's promise.
    unsafe { library.get::<F>(name.as_bytes()) }.map(|function| *function).map_err(|_| ModuleError::Function(name))
}

/// What a description says.
///
/// # Safety
/// It is null or what the header says.
unsafe fn described(raw: *const RawDescription) -> Result<(String, Vec<ModuleParameter>), ModuleError> {
    if raw.is_null() {
        return Err(ModuleError::NoDescription);
    }
    // SAFETY: not null; the version stands first in every version.
    let abi = unsafe { raw.cast::<u32>().read() };
    if abi != MODULE_ABI {
        return Err(ModuleError::Abi(abi));
    }
    // SAFETY: a description of this version; its texts end with 0, and it has as many parameters as it says.
    unsafe {
        let RawDescription { parameter_count, name, parameters, .. } = raw.read();
        let count = parameter_count as usize;
        if count > MOST_PARAMETERS || (count > 0 && parameters.is_null()) {
            return Err(ModuleError::Description("parameters"));
        }
        let mut known = Vec::with_capacity(count);
        for index in 0..count {
            let RawParameter { name, unit, help, minimum, maximum, initial } = parameters.add(index).read();
            let [name, unit, help] =
                [(name, "a parameter's name"), (unit, "a parameter's unit"), (help, "a parameter's help")]
                    .map(|(pointer, what)| text(pointer, what));
            let (name, unit, help) = (name?, unit?, help?);
            known.push(ModuleParameter { name, unit, help, minimum, maximum, initial, fixed: false });
        }
        Ok((text(name, "name")?, known))
    }
}

/// A text of a description.
///
/// # Safety
/// It is null or ends with 0.
unsafe fn text(pointer: *const c_char, what: &'static str) -> Result<String, ModuleError> {
    if pointer.is_null() {
        return Err(ModuleError::Description(what));
    }
    // SAFETY: the caller's promise.
    Ok(unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned())
}
