//! Settings structs whose fields carry their documentation and default side by side.

/// Defines public settings structs with `Default` and with `serde` forms that refuse unknown fields; the caller's crate depends
/// on `serde`. They are `Copy`, unless `owned:` comes first.
///
/// ```
/// tryon_geometry::settings! {
///     /// Settings of a filter.
///     pub struct FilterSettings {
///         /// Radius, metres. Larger smooths more.
///         pub radius: f64 = 0.02,
///     }
/// }
/// assert_eq!(FilterSettings::default().radius, 0.02);
/// ```
#[macro_export]
macro_rules! settings {
    (owned: $($structs:tt)*) => {
        $crate::settings! { @define #[derive(Clone, Debug, PartialEq)] $($structs)* }
    };
    (@define #[$derive:meta] $($(#[$doc:meta])* pub struct $name:ident {
        $($(#[$field_doc:meta])* pub $field:ident: $type:ty = $default:expr,)*
    })*) => {$(
        $(#[$doc])*
        #[$derive]
        #[derive(serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }
    )*};
    ($($structs:tt)*) => {
        $crate::settings! { @define #[derive(Clone, Copy, Debug, PartialEq)] $($structs)* }
    };
}
