//! What makes a struct a sample.

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A fixed-size, padding-free message between two processes.
///
/// Implemented only by the [`sample!`](crate::sample!) macro. The `zerocopy` bounds make padding,
/// references and invalid bit patterns compile errors.
pub trait Sample:
    FromBytes + IntoBytes + Immutable + KnownLayout + Copy + core::fmt::Debug + 'static
{
    /// The name and version of the type, `graver.Setpoint.v1`; a changed meaning is a new version.
    const NAME: &'static str;

    /// A hash over the fields' names, order and types: two builds that disagree refuse each other
    /// instead of misreading.
    const LAYOUT: u64;

    /// A sample of zeros: what a stage has before the first one arrives.
    fn zeroed() -> Self {
        Self::new_zeroed()
    }
}

/// FNV-1a, 64 bit: stable, and computable at compile time.
pub const fn fnv1a(bytes: &[u8]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut index = 0;
    while index < bytes.len() {
        hash = (hash ^ bytes[index] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        index += 1;
    }
    hash
}

/// Declares a sample: a padding-free `#[repr(C)]` struct with its versioned name and layout hash.
#[macro_export]
macro_rules! sample {
    (
        $(#[$outer:meta])*
        $name:ident = $wire:literal {
            $( $(#[$inner:meta])* $field:ident : $type:ty ),* $(,)?
        }
    ) => {
        $(#[$outer])*
        #[derive(
            Debug, Clone, Copy, PartialEq,
            zerocopy::FromBytes, zerocopy::IntoBytes, zerocopy::Immutable, zerocopy::KnownLayout,
        )]
        #[repr(C)]
        pub struct $name {
            $( $(#[$inner])* pub $field: $type, )*
        }

        impl $crate::sample::Sample for $name {
            const NAME: &'static str = $wire;
            const LAYOUT: u64 = $crate::sample::fnv1a(
                concat!($wire, $( ";", stringify!($field), ":", stringify!($type) ),*).as_bytes(),
            ) ^ core::mem::size_of::<$name>() as u64;
        }

        impl Default for $name {
            fn default() -> Self {
                $crate::sample::Sample::zeroed()
            }
        }
    };
}
