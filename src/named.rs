//! Enumerations whose variants have names.

/// An enumeration each of whose variants stands beside its name: with a list of all of them and a method that names one.
macro_rules! named {
    (
        $(#[$of_all:meta])*
        $visible:vis enum $type:ident {
            $($(#[$of_one:meta])* $variant:ident $(= $number:literal)? => $name:literal,)+
        }
    ) => {
        $(#[$of_all])*
        $visible enum $type {
            $($(#[$of_one])* $variant $(= $number)?,)+
        }

        impl $type {
            /// All of them, in order.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// The name in files, messages and reports.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }
        }
    };
}
