//! Slow inputs and outputs by Modbus TCP: chiller, extraction, laser source, interlock words.
//!
//! A process of its own beside the real-time ones, which nobody waits for. Each device of the machine file is asked in
//! its period for all its inputs and told all its outputs, whether they changed or not. What the devices say goes to
//! the controller as one sample of fixed size; what is to be switched comes with the controller's progress.
//!
//! | what happens | the controller takes it as |
//! |---|---|
//! | a device does not answer in time, refuses a request, or answers something else | that device being silent |
//! | this process dies or stands still | every device being silent, at once or when its newest answer is too old |
//! | this process ends, or the controller says nothing for a second | – the outputs go to their safe states |

pub mod conversation;
pub mod heard;
pub mod service;
pub mod tasks;
