//! The `flockform` program: parse, dispatch, exit code.

mod cli;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let arguments = cli::Arguments::parse();
    cli::start_log(arguments.verbose);
    match cli::dispatch(arguments.command) {
        Ok(code) => code,
        Err(refusal) => {
            eprintln!("error: {refusal}");
            ExitCode::from(cli::BAD_INPUT)
        }
    }
}
