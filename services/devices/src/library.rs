//! Shared libraries of the box: loaded by name, functions resolved by name.
#![allow(unsafe_code)] // a library runs code when it is loaded, and tells no types

use super::{DeviceError, Family};
use libloading::Library;

/// Table of a library's C functions, resolved together.
macro_rules! functions {
    ($(#[$meta:meta])* $table:ident { $($name:ident($($arg:ty),* $(,)?) $(-> $ret:ty)?;)* }) => {
        $(#[$meta])*
        #[allow(non_snake_case)] // the names are C's
        #[derive(Clone, Copy)]
        struct $table {
            $($name: unsafe extern "C" fn($($arg),*) $(-> $ret)?,)*
        }

        impl $table {
            /// Looks up every function.
            ///
            /// # Safety
            /// The library's header declares each with these arguments, and the table is not used after it is unloaded.
            unsafe fn resolve(library: &libloading::Library) -> Result<Self, libloading::Error> {
                // SAFETY: the caller vouches for the signatures.
                unsafe {
                    Ok(Self {
                        $($name: *library.get(stringify!($name).as_bytes())?,)*
                    })
                }
            }
        }
    };
}
pub(crate) use functions;

/// Loads the library of a family, from the places in which the system's loader searches.
///
/// # Errors
/// Names the package to install.
pub(crate) fn load(family: Family) -> Result<Library, DeviceError> {
    let (name, _) = family.library();
    // SAFETY: the libraries of `Family::library` are installed by the box's administrator, who trusts them as any other
    // program of the box; their initialisers set up their own state and nothing of this process.
    unsafe { Library::new(name) }.map_err(|e| DeviceError::missing(family, e.to_string()))
}
