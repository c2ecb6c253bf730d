//! Publishes the state of a machine to a fleet and takes its jobs, over NATS JetStream.
