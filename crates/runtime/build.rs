//! Compiles the recording's message definitions, without an installed `protoc`.

use std::error::Error;
use std::path::Path;
use std::{env, fs};

use prost::Message;

const DEFINITIONS: &str = "proto/cotouch.proto";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed={DEFINITIONS}");
    let mut descriptors = protox::compile([DEFINITIONS], ["proto"])?;
    prost_build::Config::new().compile_fds(descriptors.clone())?;
    // Readers need no comments: what every recording carries stays small.
    descriptors.file.iter_mut().for_each(|file| file.source_code_info = None);
    let out = env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?;
    fs::write(Path::new(&out).join("cotouch.descriptors"), descriptors.encode_to_vec())?;
    Ok(())
}
