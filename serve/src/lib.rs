//! The live page, the HTTP interface and the metrics of a running pipeline.
