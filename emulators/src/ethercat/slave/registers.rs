//! Addresses of an EtherCAT slave controller's registers (ETG.1000.4, and the data sheets of the ET1100).

/// Station address.
pub(crate) const STATION: u16 = 0x0010;
/// Station alias.
pub(crate) const ALIAS: u16 = 0x0012;
/// Whether the alias may stand for the station address: bit 24 of the data link's control.
pub(crate) const ALIAS_ENABLED: u16 = 0x0103;
/// Data link status.
pub(crate) const DL_STATUS: u16 = 0x0110;
/// Requested state.
pub(crate) const AL_CONTROL: u16 = 0x0120;
/// State.
pub(crate) const AL_STATUS: u16 = 0x0130;
/// Why a state was refused or left.
pub(crate) const AL_CODE: u16 = 0x0134;
/// Which events datagrams carry.
pub(crate) const EVENT_MASK: u16 = 0x0200;
/// Events to the master.
pub(crate) const EVENTS: u16 = 0x0210;
/// Frames with a wrong checksum at port 0.
pub(crate) const INVALID_FRAMES: u16 = 0x0300;
/// Unit of the watchdogs: 40 ns times this plus two.
pub(crate) const WATCHDOG_DIVIDER: u16 = 0x0400;
/// Time of the process data watchdog in its units; 0: there is none.
pub(crate) const WATCHDOG_TIME: u16 = 0x0420;
/// Bit 0: the watchdog has not expired.
pub(crate) const WATCHDOG_STATUS: u16 = 0x0440;
/// How often it has.
pub(crate) const WATCHDOG_COUNT: u16 = 0x0442;
/// Access to the EEPROM.
pub(crate) const EEPROM_CONTROL: u16 = 0x0502;
/// Word address in the EEPROM.
pub(crate) const EEPROM_ADDRESS: u16 = 0x0504;
/// Data of the EEPROM.
pub(crate) const EEPROM_DATA: u16 = 0x0508;
/// Memory mapping units, 16 bytes each.
pub(crate) const FMMU: u16 = 0x0600;
/// Sync managers, 8 bytes each.
pub(crate) const SYNC_MANAGERS: u16 = 0x0800;
/// Times at which the last write to 0x0900 came in at the ports.
pub(crate) const RECEIVE_TIMES: u16 = 0x0900;
/// System time.
pub(crate) const SYSTEM_TIME: u16 = 0x0910;
/// Time at which the last write to 0x0900 came to the processing unit.
pub(crate) const RECEIVE_TIME: u16 = 0x0918;
/// System time minus local time.
pub(crate) const SYSTEM_OFFSET: u16 = 0x0920;
/// Delay from the reference clock.
pub(crate) const SYSTEM_DELAY: u16 = 0x0928;
/// How far the clock is off the reference, by magnitude and sign.
pub(crate) const SYSTEM_DIFFERENCE: u16 = 0x092C;
/// Which of SYNC0 and SYNC1 are made.
pub(crate) const SYNC_ACTIVATION: u16 = 0x0981;
/// Time of the next SYNC0.
pub(crate) const SYNC_START: u16 = 0x0990;
/// Period of SYNC0 [ns].
pub(crate) const SYNC0_PERIOD: u16 = 0x09A0;
/// From SYNC0 to SYNC1 [ns].
pub(crate) const SYNC1_PERIOD: u16 = 0x09A4;

/// Start of the process memory.
pub(crate) const PROCESS_MEMORY: u16 = 0x1000;
/// Bytes of the whole memory.
pub(crate) const MEMORY: usize = 0x3000;
/// How many memory mapping units there are.
pub(crate) const FMMUS: usize = 8;
/// How many sync managers there are.
pub(crate) const MANAGERS: usize = 8;
