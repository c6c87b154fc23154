//! A shared library with the five functions of `stickslip_module.h`, called by its owner only.
//!
//! The library is unchecked code inside the process that opens it. An untrusted library is opened in a separate
//! process.

#![expect(unsafe_code, reason = "functions of a library are called by address and return pointers")]

use std::ffi::{CStr, c_char, c_void};
use std::path::Path;

use libloading::Library;

/// Version of the functions, as in the header.
pub const MODULE_ABI: u32 = 1;
/// Maximum number of parameters.
pub const MOST_PARAMETERS: usize = 4096;

/// Error of a library.
#[derive(Debug, thiserror::Error)]
pub enum ModuleError {
    /// The system cannot open it.
    #[error("it cannot be opened ({0}). Compile it for this machine, as a shared library (cc -shared -fPIC)")]
    Open(String),
    /// A function is missing.
    #[error(
        "it has no function {0}. Include stickslip_module.h and define all five; in C++ the header makes them extern \"C\""
    )]
    Function(&'static str),
    /// It has no description.
    #[error("stickslip_describe returns NULL. Return the address of a static stickslip_description")]
    NoDescription,
    /// It was compiled with another version of the header.
    #[error(
        "its functions have version {0}, and version 1 is required. Compile it with the stickslip_module.h of this \
         version"
    )]
    Abi(u32),
    /// A text is missing, or parameters are missing or too many.
    #[error("{0} is NULL or too many in its description. Complete the description")]
    Description(&'static str),
}

/// A parameter as the library describes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModuleParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Meaning.
    pub help: String,
    /// Smallest value.
    pub minimum: f64,
    /// Largest value.
    pub maximum: f64,
    /// Default value.
    pub initial: f64,
    /// Whether it applies at the start of a controller only.
    pub fixed: bool,
}

/// Inputs of a sample, in the order of the header.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModuleSample {
    /// Time since the start [s].
    pub time: f64,
    /// Reference angle [rad].
    pub reference_position: f64,
    /// First derivative of the reference angle [rad/s].
    pub reference_velocity: f64,
    /// Second derivative of the reference angle [rad/s²].
    pub reference_acceleration: f64,
    /// Angle from the encoder, unwrapped [rad].
    pub measured_angle: f64,
    /// Motor velocity from the tacho [rad/s].
    pub measured_velocity: f64,
    /// Screw velocity from the observer of the bench [rad/s]. For a controller, this and all following values are 0.
    pub estimated_velocity: f64,
    /// Torque of the load motor from its current, against positive motion [N m].
    pub measured_load_torque: f64,
    /// Torque command of the drive in the previous tick [N m].
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
    /// Kept open while its functions can be called.
    _library: Library,
}

// SAFETY: the header permits any thread, one at a time; only the owner of the module calls it.
unsafe impl Send for Module {}

impl Module {
    /// Opens a library and reads its description.
    ///
    /// # Errors
    /// [`ModuleError`].
    pub fn open(path: &Path) -> Result<Self, ModuleError> {
        // A name without a folder would be searched for among the system's libraries.
        let path = path.canonicalize().map_err(|error| ModuleError::Open(error.to_string()))?;
        // SAFETY: opening runs code of the library, which the documentation states.
        let library = unsafe { Library::new(path) }.map_err(|error| ModuleError::Open(error.to_string()))?;
        // SAFETY: functions with these names have the types of the header.
        let (describe, begin, set, step, end) = unsafe {
            (
                function::<Describe>(&library, "stickslip_describe")?,
                function::<Begin>(&library, "stickslip_begin")?,
                function::<Set>(&library, "stickslip_set")?,
                function::<Step>(&library, "stickslip_step")?,
                function::<End>(&library, "stickslip_end")?,
            )
        };
        // SAFETY: it may be called first; its result lives as long as the library. Of another version only the first
        // number is read.
        let (name, parameters) = unsafe { read(describe())? };
        let controller = std::ptr::null_mut();
        Ok(Module { name, parameters, begin, set, step, end, controller, _library: library })
    }

    /// Name of the library.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Parameters of the library.
    pub fn parameters(&self) -> &[ModuleParameter] {
        &self.parameters
    }

    /// Ends the present controller and starts a new one at rest. Returns whether the library accepts these numbers.
    /// There must be one value for each parameter.
    pub fn begin(&mut self, sample_time: f64, torque_limit: f64, values: &[f64]) -> bool {
        assert_eq!(values.len(), self.parameters.len(), "a value of each parameter");
        self.end();
        // SAFETY: as many values as parameters, which live through the call.
        self.controller = unsafe { (self.begin)(sample_time, torque_limit, values.as_ptr()) };
        !self.controller.is_null()
    }

    /// Sets new parameter values. Returns the result of its function.
    pub fn set(&mut self, values: &[f64]) -> i32 {
        assert_eq!(values.len(), self.parameters.len(), "a value of each parameter");
        if self.controller.is_null() {
            return 0;
        }
        // SAFETY: a started controller; as many values as parameters.
        unsafe { (self.set)(self.controller, values.as_ptr()) }
    }

    /// One sample: the torque [N m].
    ///
    /// # Errors
    /// Non-zero result of its function; -1 before the start of a controller.
    pub fn step(&mut self, sample: &ModuleSample) -> Result<f64, i32> {
        if self.controller.is_null() {
            return Err(-1);
        }
        let mut torque = f64::NAN;
        // SAFETY: a started controller; both pointers are local variables.
        match unsafe { (self.step)(self.controller, sample, &mut torque) } {
            0 => Ok(torque),
            code => Err(code),
        }
    }

    fn end(&mut self) {
        let controller = std::mem::replace(&mut self.controller, std::ptr::null_mut());
        if !controller.is_null() {
            // SAFETY: a started controller whose address is not used afterwards.
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
    // SAFETY: guaranteed by the caller.
    unsafe { library.get::<F>(name.as_bytes()) }.map(|function| *function).map_err(|_| ModuleError::Function(name))
}

/// Name and parameters of a description.
///
/// # Safety
/// It is null or as the header requires.
unsafe fn read(raw: *const RawDescription) -> Result<(String, Vec<ModuleParameter>), ModuleError> {
    if raw.is_null() {
        return Err(ModuleError::NoDescription);
    }
    // SAFETY: not null; every version starts with the version number.
    let abi = unsafe { raw.cast::<u32>().read() };
    if abi != MODULE_ABI {
        return Err(ModuleError::Abi(abi));
    }
    // SAFETY: a description of this version; its texts end with 0, and it has `parameter_count` parameters.
    unsafe {
        let RawDescription { parameter_count, name, parameters, .. } = raw.read();
        let count = parameter_count as usize;
        if count > MOST_PARAMETERS || (count > 0 && parameters.is_null()) {
            return Err(ModuleError::Description("parameters"));
        }
        let mut list = Vec::with_capacity(count);
        for index in 0..count {
            let RawParameter { name, unit, help, minimum, maximum, initial } = parameters.add(index).read();
            let [name, unit, help] =
                [(name, "a parameter's name"), (unit, "a parameter's unit"), (help, "a parameter's help")]
                    .map(|(pointer, what)| text(pointer, what));
            let (name, unit, help) = (name?, unit?, help?);
            list.push(ModuleParameter { name, unit, help, minimum, maximum, initial, fixed: false });
        }
        Ok((text(name, "name")?, list))
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
    // SAFETY: guaranteed by the caller.
    Ok(unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned())
}
