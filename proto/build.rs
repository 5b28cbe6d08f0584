//! Generates the types of the messages from `proto/*.proto` without protoc: protox compiles, tonic-prost-build emits.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-changed=proto");
    let descriptors = protox::compile(["fleet.proto", "solver.proto"], ["proto"])?;
    tonic_prost_build::configure().bytes(".").codec_path("crate::Codec").compile_fds(descriptors)?;
    Ok(())
}
