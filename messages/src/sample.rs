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

    /// A hash over the fields' names, order and types, through all samples and arrays inside: two
    /// builds that disagree refuse each other instead of misreading.
    const LAYOUT: u64;

    /// A sample of zeros: what a stage has before the first one arrives.
    fn zeroed() -> Self {
        Self::new_zeroed()
    }
}

/// What a field of a sample can be: a number, another sample, or an array of either.
pub trait Field {
    /// A hash that tells types apart whose bytes mean different things.
    const SHAPE: u64;
}

macro_rules! number {
    ($($type:ty),*) => {
        $(impl Field for $type {
            const SHAPE: u64 = fnv1a(stringify!($type).as_bytes());
        })*
    };
}

number!(u8, u16, u32, u64, i32, i64, f64, crate::Nanoseconds, crate::Cycle);

impl<T: Field, const N: usize> Field for [T; N] {
    const SHAPE: u64 = fnv1a_on(T::SHAPE, &(N as u64).to_le_bytes());
}

/// FNV-1a, 64 bit: stable, and computable at compile time.
pub const fn fnv1a(bytes: &[u8]) -> u64 {
    fnv1a_on(0xcbf2_9ce4_8422_2325, bytes)
}

/// FNV-1a of what led to `hash`, and of `bytes` after it.
pub const fn fnv1a_on(mut hash: u64, bytes: &[u8]) -> u64 {
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
            const LAYOUT: u64 = {
                use $crate::sample::{Field, fnv1a, fnv1a_on};
                let hash = fnv1a($wire.as_bytes());
                $(
                    let hash = fnv1a_on(hash, concat!(";", stringify!($field), ":").as_bytes());
                    let hash = fnv1a_on(hash, &<$type as Field>::SHAPE.to_le_bytes());
                )*
                hash
            };
        }

        impl $crate::sample::Field for $name {
            const SHAPE: u64 = <Self as $crate::sample::Sample>::LAYOUT;
        }

        impl Default for $name {
            fn default() -> Self {
                $crate::sample::Sample::zeroed()
            }
        }
    };
}

#[cfg(test)]
#[allow(unreachable_pub)] // The macro makes its samples public.
mod tests {
    use super::Sample;

    mod plain {
        crate::sample! {
            /// A sample.
            Inner = "test.Inner.v1" { /// One.
                first: f64, /// Two.
                second: f64 }
        }
        crate::sample! {
            /// A sample that holds another.
            Outer = "test.Outer.v1" { /// Held.
                inner: [Inner; 2], /// A number.
                number: u64 }
        }
    }

    /// The same bytes as `plain`, with one thing changed each time.
    mod changed {
        pub(super) mod order {
            crate::sample! {
                /// Fields the other way round.
                Inner = "test.Inner.v1" { /// Two.
                    second: f64, /// One.
                    first: f64 }
            }
            crate::sample! {
                /// Changed only inside.
                Outer = "test.Outer.v1" { /// Held.
                    inner: [Inner; 2], /// A number.
                    number: u64 }
            }
        }
        crate::sample! {
            /// Another type of the same size.
            Inner = "test.Inner.v1" { /// One.
                first: f64, /// Two.
                second: u64 }
        }
        pub(super) mod version {
            crate::sample! {
                /// Another version.
                Inner = "test.Inner.v2" { /// One.
                    first: f64, /// Two.
                    second: f64 }
            }
        }
        pub(super) mod name {
            crate::sample! {
                /// Another name.
                Inner = "test.Inner.v1" { /// One.
                    first: f64, /// Two.
                    third: f64 }
            }
        }
    }

    #[test]
    fn any_change_of_a_layout_changes_its_hash_even_deep_inside() {
        let plain = plain::Inner::LAYOUT;
        assert_ne!(plain, changed::order::Inner::LAYOUT);
        assert_ne!(plain, changed::Inner::LAYOUT);
        assert_ne!(plain, changed::version::Inner::LAYOUT);
        assert_ne!(plain, changed::name::Inner::LAYOUT);
        assert_ne!(plain::Outer::LAYOUT, changed::order::Outer::LAYOUT);
    }

    #[test]
    fn no_two_samples_share_a_layout() {
        let mut layouts = [
            crate::Setpoint::LAYOUT,
            crate::Command::LAYOUT,
            crate::Feedback::LAYOUT,
            crate::Progress::LAYOUT,
            crate::LaserCycle::LAYOUT,
            crate::GateEdge::LAYOUT,
            crate::Fault::LAYOUT,
            crate::JobOffer::LAYOUT,
            crate::PlannerReport::LAYOUT,
            crate::ControllerReport::LAYOUT,
            crate::DrivesReport::LAYOUT,
            crate::LinkCounters::LAYOUT,
            crate::RealtimeFacts::LAYOUT,
            crate::Stalls::LAYOUT,
            crate::OperatorRequest::LAYOUT,
            crate::OperatorReply::LAYOUT,
            crate::SimulatedInputs::LAYOUT,
            crate::Given::LAYOUT,
            crate::SentSetpoint::LAYOUT,
        ];
        layouts.sort_unstable();
        assert!(layouts.windows(2).all(|pair| pair[0] != pair[1]), "{layouts:x?}");
    }

    #[test]
    fn a_new_sample_is_all_zeros() {
        assert_eq!(
            zerocopy::IntoBytes::as_bytes(&crate::Setpoint::zeroed()),
            [0; { core::mem::size_of::<crate::Setpoint>() }]
        );
    }
}
