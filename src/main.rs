//! The `flockform` program: parse, dispatch, exit code.

mod cli;

use std::process::ExitCode;

#[cfg(target_os = "linux")]
#[global_allocator]
static ALLOCATOR: cli::memory::ArrayAllocator = cli::memory::ArrayAllocator;

fn main() -> ExitCode {
    let done = cli::arguments().and_then(|(arguments, ros)| {
        cli::spare_memory(&arguments.command);
        cli::log::start(&arguments, &ros);
        cli::interrupt::watch();
        cli::dispatch(arguments.command, &ros)
    });
    done.unwrap_or_else(|refusal| cli::refuse(&refusal))
}
