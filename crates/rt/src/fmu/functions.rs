//! The functions of FMI 2.0.4 and 3.0.1 for co-simulation, with the types of their headers.

use std::ffi::{c_char, c_int, c_void};

use libloading::Library;

use super::FmuError;
use super::log::log_three;

/// An instance.
pub(super) type Instance = *mut c_void;
type Text = *const c_char;
type Status = c_int;
/// `int` in FMI 2.0.
type Boolean = c_int;
type LogThree = unsafe extern "C" fn(*mut c_void, Status, Text, Text);

/// `fmi2CoSimulation`.
pub(super) const CO_SIMULATION: c_int = 1;

/// `fmi2CallbackFunctions`.
#[repr(C)]
pub(super) struct Callbacks {
    /// Variadic function.
    pub(super) logger: unsafe extern "C" fn(),
    pub(super) allocate_memory: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    pub(super) free_memory: unsafe extern "C" fn(*mut c_void),
    /// Not used: steps are synchronous.
    pub(super) step_finished: *const c_void,
    pub(super) environment: *const c_void,
}

// SAFETY: it is never written to; its environment is a log, which accepts messages from any thread.
unsafe impl Send for Callbacks {}
// SAFETY: as before.
unsafe impl Sync for Callbacks {}

/// A table of functions, each with its name in the library.
macro_rules! functions {
    ($(#[$about:meta])* $Table:ident { $($field:ident: $symbol:literal, fn($($argument:ty),*) $(-> $result:ty)?;)+ }) => {
        $(#[$about])*
        pub(super) struct $Table {
            $(pub(super) $field: unsafe extern "C" fn($($argument),*) $(-> $result)?,)+
        }

        impl $Table {
            /// The functions of a library.
            ///
            /// # Safety
            /// Its functions of these names must be those of the standard.
            pub(super) unsafe fn of(library: &Library) -> Result<Self, FmuError> {
                // SAFETY: guaranteed by the caller.
                Ok($Table { $($field: unsafe { function(library, $symbol)? },)+ })
            }
        }
    };
}

functions! {
    /// Functions of FMI 2.0.
    Two {
        instantiate: "fmi2Instantiate", fn(Text, c_int, Text, Text, *const Callbacks, Boolean, Boolean) -> Instance;
        free: "fmi2FreeInstance", fn(Instance);
        setup: "fmi2SetupExperiment", fn(Instance, Boolean, f64, f64, Boolean, f64) -> Status;
        enter: "fmi2EnterInitializationMode", fn(Instance) -> Status;
        exit: "fmi2ExitInitializationMode", fn(Instance) -> Status;
        terminate: "fmi2Terminate", fn(Instance) -> Status;
        set: "fmi2SetReal", fn(Instance, *const u32, usize, *const f64) -> Status;
        get: "fmi2GetReal", fn(Instance, *const u32, usize, *mut f64) -> Status;
        step: "fmi2DoStep", fn(Instance, f64, f64, Boolean) -> Status;
    }
}

functions! {
    /// Functions of FMI 3.0. A `bool` output is read as a byte, since some tools write values other than 0 and 1.
    Three {
        instantiate: "fmi3InstantiateCoSimulation", fn(
            Text, Text, Text, bool, bool, bool, bool, *const u32, usize, *const c_void, LogThree, *const c_void
        ) -> Instance;
        free: "fmi3FreeInstance", fn(Instance);
        enter: "fmi3EnterInitializationMode", fn(Instance, bool, f64, f64, bool, f64) -> Status;
        exit: "fmi3ExitInitializationMode", fn(Instance) -> Status;
        terminate: "fmi3Terminate", fn(Instance) -> Status;
        set: "fmi3SetFloat64", fn(Instance, *const u32, usize, *const f64, usize) -> Status;
        get: "fmi3GetFloat64", fn(Instance, *const u32, usize, *mut f64, usize) -> Status;
        step: "fmi3DoStep", fn(Instance, f64, f64, bool, *mut u8, *mut u8, *mut u8, *mut f64) -> Status;
    }
}

/// The functions for the version of an FMU.
pub(super) enum Functions {
    Two(Two),
    Three(Three),
}

/// Arguments of an instantiation.
pub(super) struct Identity<'a> {
    pub(super) token: Text,
    pub(super) resources: Text,
    pub(super) callbacks: *const Callbacks,
    pub(super) log: &'a super::log::Log,
}

impl Functions {
    /// A new instance; null if the FMU refuses.
    ///
    /// # Safety
    /// The arguments outlive the instance.
    pub(super) unsafe fn instantiate(&self, of: &Identity<'_>) -> Instance {
        let name = c"controller".as_ptr();
        let log = std::ptr::from_ref(of.log).cast();
        let none = std::ptr::null();
        // SAFETY: texts that end with 0, callbacks that live as long as the instance.
        unsafe {
            match self {
                Functions::Two(two) => {
                    (two.instantiate)(name, CO_SIMULATION, of.token, of.resources, of.callbacks, 0, 0)
                }
                Functions::Three(three) => (three.instantiate)(
                    name,
                    of.token,
                    of.resources,
                    false,
                    false,
                    false,
                    false,
                    none,
                    0,
                    log,
                    log_three,
                    none.cast(),
                ),
            }
        }
    }

    /// Sets numbers.
    ///
    /// # Safety
    /// The instance lives.
    pub(super) unsafe fn set(&self, instance: Instance, references: &[u32], values: &[f64]) -> Status {
        let count = references.len().min(values.len());
        // SAFETY: `count` references and values.
        unsafe {
            match self {
                Functions::Two(two) => (two.set)(instance, references.as_ptr(), count, values.as_ptr()),
                Functions::Three(three) => (three.set)(instance, references.as_ptr(), count, values.as_ptr(), count),
            }
        }
    }

    /// Reads numbers.
    ///
    /// # Safety
    /// The instance lives.
    pub(super) unsafe fn get(&self, instance: Instance, references: &[u32], values: &mut [f64]) -> Status {
        let count = references.len().min(values.len());
        // SAFETY: `count` references and values.
        unsafe {
            match self {
                Functions::Two(two) => (two.get)(instance, references.as_ptr(), count, values.as_mut_ptr()),
                Functions::Three(three) => {
                    (three.get)(instance, references.as_ptr(), count, values.as_mut_ptr(), count)
                }
            }
        }
    }

    /// Enters initialization mode, at time 0.
    ///
    /// # Safety
    /// The instance lives.
    pub(super) unsafe fn enter(&self, instance: Instance) -> Status {
        // SAFETY: guaranteed by the caller.
        unsafe {
            match self {
                Functions::Two(two) => (two.enter)(instance),
                Functions::Three(three) => (three.enter)(instance, false, 0.0, 0.0, false, 0.0),
            }
        }
    }
}

/// The function of this name.
///
/// # Safety
/// It must be of this type.
unsafe fn function<F: Copy>(library: &Library, name: &'static str) -> Result<F, FmuError> {
    // SAFETY: guaranteed by the caller.
    unsafe { library.get::<F>(name.as_bytes()) }.map(|function| *function).map_err(|_| FmuError::Function(name))
}
