//! What a person asks of a running machine.

use crate::sample;

/// A request to the controller. Discriminants are the values in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum OperatorVerb {
    /// Power the motors at standstill.
    Enable = 1,
    /// Unpower the motors; only at rest.
    Disable = 2,
    /// Feed hold: laser off, to rest along the path.
    Hold = 3,
    /// Go on from a hold without losing or doubling a mark.
    Resume = 4,
    /// Give the stream up: laser off, to rest along the path.
    Stop = 5,
    /// Clear a latched fault; only at rest.
    Reset = 6,
    /// Override the rate, `value` 0.1..=2: up to 1 the stream is played at this rate, above it is for
    /// the planner to plan faster.
    Override = 7,
    /// Play the stream whose number is `value`; no other stream is ever played.
    Start = 8,
    /// Find the reference of the axes whose bits `axis` has, 0 for all, in the machine file's order.
    Home = 9,
    /// Move axis `axis` at speed `value`, with its sign, for as long as [`Self::JogOn`] comes within the machine
    /// file's `safety.dead_man`; 0 stops it.
    Jog = 10,
    /// Move axis `axis` on by `value`, at speed `second` at most.
    Step = 11,
    /// Light with power `value`, 0..=1, for `second` [s].
    TestPulse = 12,
    /// Move axis `axis` on by `value` at speed `second` until the probe touches.
    Probe = 13,
    /// Go on with the jog of axis `axis` whose reply had the number `value`. One that has ended, for whatever
    /// reason, is not begun anew.
    JogOn = 14,
    /// Switch output `axis`, from 1, on for a `value` of 1 and off for 0.
    Output = 15,
    /// Override the power of the laser, `value` 0.1..=2: each power that the stream asks for is so many times as much, and
    /// full power at most, and a frame `safety.frame_power` of the machine file. It ends with the stream.
    Power = 16,
    /// Override the rate of rapids, `value` 0.1..=1: what is flown between marks, as far as the rate is back where a mark
    /// begins.
    Rapid = 17,
}

impl OperatorVerb {
    /// The verb with this number in a sample.
    pub fn from_wire(value: u32) -> Option<Self> {
        Some(match value {
            1 => Self::Enable,
            2 => Self::Disable,
            3 => Self::Hold,
            4 => Self::Resume,
            5 => Self::Stop,
            6 => Self::Reset,
            7 => Self::Override,
            8 => Self::Start,
            9 => Self::Home,
            10 => Self::Jog,
            11 => Self::Step,
            12 => Self::TestPulse,
            13 => Self::Probe,
            14 => Self::JogOn,
            15 => Self::Output,
            16 => Self::Power,
            17 => Self::Rapid,
            _ => return None,
        })
    }
}

sample! {
    /// One request, from the domain holder to the controller.
    OperatorRequest = "graver.OperatorRequest.v2" {
        /// An [`OperatorVerb`].
        verb: u32,
        /// Numbers requests, so that an answer can be told from an older one.
        ticket: u32,
        /// The axis from 1, or bits of axes, where the verb is about axes; else 0. [`MAX_AXES`](crate::MAX_AXES) + 1 to
        /// + 3 is the tool along x, y and z.
        axis: u32,
        /// Always 0; keeps the sample free of padding.
        reserved: u32,
        /// The verb's argument, 0 without.
        value: f64,
        /// Its second one, 0 without.
        second: f64,
    }
}

sample! {
    /// Inputs of a simulated machine that people have set, from the domain holder to drives.
    SimulatedInputs = "graver.SimulatedInputs.v1" {
        /// One bit each, in the order of the machine file: 1 is active.
        inputs: u64,
    }
}

sample! {
    /// The controller's answer, given as soon as the request is accepted or refused; its effect
    /// shows in the progress.
    OperatorReply = "graver.OperatorReply.v4" {
        /// The request's ticket.
        ticket: u32,
        /// 1 when it is carried out, 0 when it is refused.
        accepted: u32,
        /// The [`ControllerState`](crate::ControllerState) it met.
        state: u32,
        /// A [`Refusal`](crate::Refusal): why it is refused.
        refusal: u32,
        /// The axis that it is refused for, from 1; 0 for none.
        axis: u32,
        /// How many requests the controller has accepted, this one included.
        number: u32,
        /// What was found, as the refusal says.
        found: f64,
        /// What was due, as the refusal says.
        limit: f64,
        /// The rate that is asked for since the last override, 1 before the first.
        value: f64,
        /// So many times the power that the stream asks for is given since the last override of it, 1 before the first.
        power: f64,
    }
}
