//! Software that speaks grbl 1.1 operates a pipeline: the protocol, and its server over TCP.
