//! How parameters lie in a frame: one after the other from P0 on, each with its low octet first. One table of messages says
//! fields and their order for both directions and for whoever shows them.

/// What a parameter can be.
pub(super) trait Parameter: Sized {
    /// Takes it off the front; octets that are not there are 0.
    fn take(octets: &mut &[u8]) -> Self;
    /// Writes it to the front of the rest; what does not fit is left out.
    fn put(self, octets: &mut &mut [u8]);
    /// Its numbers.
    fn tell(self, to: impl FnMut(i64));
}

macro_rules! whole_numbers {
    ($($kind:ty)*) => {$(
        impl Parameter for $kind {
            fn take(octets: &mut &[u8]) -> Self {
                let mut value = [0; size_of::<$kind>()];
                for octet in &mut value {
                    if let Some((first, rest)) = octets.split_first() {
                        (*octet, *octets) = (*first, rest);
                    }
                }
                <$kind>::from_le_bytes(value)
            }

            fn put(self, octets: &mut &mut [u8]) {
                for octet in self.to_le_bytes() {
                    if let Some(first) = octets.split_off_first_mut() {
                        *first = octet;
                    }
                }
            }

            fn tell(self, mut to: impl FnMut(i64)) {
                to(i64::from(self));
            }
        }
    )*};
}

whole_numbers!(u8 i8 u16 i16 u32 i32);

impl<const N: usize> Parameter for [u8; N] {
    fn take(octets: &mut &[u8]) -> Self {
        std::array::from_fn(|_| u8::take(octets))
    }

    fn put(self, octets: &mut &mut [u8]) {
        self.into_iter().for_each(|octet| octet.put(octets));
    }

    fn tell(self, mut to: impl FnMut(i64)) {
        self.into_iter().for_each(|octet| to(i64::from(octet)));
    }
}

/// A table of messages: each becomes a type with its fields and a variant of the same name.
macro_rules! messages {
    (
        $(#[$about:meta])* enum $all:ident;
        $($(#[$doc:meta])* $code:literal $name:ident $words:literal {
            $($(#[$what:meta])* $field:ident: $kind:ty,)*
        })*
    ) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Copy, PartialEq, Eq)]
            pub(crate) struct $name { $($(#[$what])* pub(crate) $field: $kind,)* }
        )*

        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum $all {
            $($(#[$doc])* $name($name),)*
            /// One that is not among them, as it came.
            Other {
                /// Its number.
                command: u8,
                /// P0 to P6.
                parameters: [u8; 7],
            },
        }

        impl $all {
            /// What a frame is; octets that its command does not use are not looked at.
            #[must_use]
            pub(crate) fn of(frame: SixpackFrame) -> Self {
                let mut octets = frame.parameters.as_slice();
                match frame.command {
                    $($code => Self::$name($name { $($field: Parameter::take(&mut octets),)* }),)*
                    command => Self::Other { command, parameters: frame.parameters },
                }
            }

            /// Its frame, with 0 in what it does not use.
            #[must_use]
            pub(crate) fn frame(self, address: u8) -> SixpackFrame {
                let mut parameters = [0; 7];
                let octets = &mut parameters.as_mut_slice();
                let command = match self {
                    $(Self::$name($name { $($field,)* }) => {
                        $($field.put(octets);)*
                        $code
                    })*
                    Self::Other { command, parameters } => {
                        parameters.put(octets);
                        command
                    }
                };
                SixpackFrame { address, command, parameters }
            }

            /// What it is, in words; nothing for one that is not among them.
            #[must_use]
            pub(crate) const fn words(&self) -> Option<&'static str> {
                match self {
                    $(Self::$name(_) => Some($words),)*
                    Self::Other { .. } => None,
                }
            }

            /// Its fields by name, in their order on the line; one of several octets comes several times.
            pub(crate) fn tell(self, mut to: impl FnMut(&'static str, i64)) {
                match self {
                    $(Self::$name($name { $($field,)* }) => {
                        $($field.tell(|value| to(stringify!($field), value));)*
                    })*
                    Self::Other { parameters, .. } => parameters.tell(|value| to("parameter", value)),
                }
            }
        }

        $(impl From<$name> for $all {
            fn from(message: $name) -> Self {
                Self::$name(message)
            }
        })*
    };
}

pub(super) use messages;
