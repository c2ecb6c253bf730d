//! Slow inputs and outputs by Modbus TCP: chiller, extraction, laser source, interlock words.
