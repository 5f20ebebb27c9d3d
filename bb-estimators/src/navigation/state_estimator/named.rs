//! Enumerations whose values have names.

/// Declares such an enumeration; one with `: Payload` is a payload where there is a runtime.
macro_rules! named {
    ($(#[$about:meta])* pub enum $name:ident $(: $payload:ident)? {
        $($(#[$of:meta])* $value:ident $({ $($fields:tt)* })? = $text:literal,)+
    }) => {
        $(#[$about])*
        $(#[cfg_attr(feature = "runtime", derive(bb_core::$payload))])?
        pub enum $name {
            $($(#[$of])* $value $({ $($fields)* })?,)+
        }

        impl $name {
            /// The name in logs and recordings.
            pub const fn name(&self) -> &'static str {
                match self {
                    $(Self::$value { .. } => $text,)+
                }
            }
        }
    };
}
pub(super) use named;
