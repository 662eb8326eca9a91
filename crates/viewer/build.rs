//! Bundles the page into the output folder, with Node's npm and the page's own `build.mjs`; never writes the source tree.
//! Without Node, or when it fails, the program is built without the page, which says so.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// Everything that the bundle is made from.
const SOURCES: [&str; 6] =
    ["package.json", "package-lock.json", "tsconfig.json", "build.mjs", "index.html", "src"];

/// What the bundle consists of; beside each file its gzip form.
const FILES: [&str; 3] = ["index.html", "page.js", "page.css"];

fn main() -> Result<(), Box<dyn Error>> {
    let source = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("page");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    println!("cargo:rerun-if-changed=build.rs");
    for name in SOURCES {
        println!("cargo:rerun-if-changed={}", source.join(name).display());
    }
    let expression = match bundle(&source, &out) {
        Ok(()) => included(&out.join("bundle")),
        Err(why) => {
            for line in why.lines().take(8) {
                println!("cargo:warning=no page: {line}");
            }
            println!(
                "cargo:warning=the page needs Node.js 20 or later and, once, the npm registry; then touch crates/viewer/build.rs and build again"
            );
            format!("Err({why:?})")
        }
    };
    fs::write(out.join("bundle.rs"), expression)?;
    Ok(())
}

/// Makes `out/bundle` from a copy of the page's sources in `out/page`; says in words why that cannot be done.
fn bundle(source: &Path, out: &Path) -> Result<(), String> {
    let page = out.join("page");
    copy_sources(source, &page).map_err(|error| format!("its sources could not be copied: {error}"))?;
    install(&page)?;
    run(Command::new("node").arg("build.mjs").arg("../bundle").current_dir(&page))?;
    let missing = FILES.iter().find(|name| !out.join("bundle").join(format!("{name}.gz")).exists());
    missing.map_or(Ok(()), |name| Err(format!("build.mjs wrote no {name}")))
}

fn copy_sources(source: &Path, page: &Path) -> io::Result<()> {
    fs::create_dir_all(page)?;
    // A file that is gone from the sources must not stay in the copy.
    match fs::remove_dir_all(page.join("src")) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    SOURCES.iter().try_for_each(|name| copy(&source.join(name), &page.join(name)))
}

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    if !from.is_dir() {
        return fs::copy(from, to).map(|_| ());
    }
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        copy(&entry.path(), &to.join(entry.file_name()))?;
    }
    Ok(())
}

/// Installs what the lock file names, unless that is there already.
fn install(page: &Path) -> Result<(), String> {
    let lock = fs::read(page.join("package-lock.json")).map_err(|error| error.to_string())?;
    let installed = page.join("node_modules/.installed-lock.json");
    if fs::read(&installed).is_ok_and(|found| found == lock) {
        return Ok(());
    }
    let quiet = [
        "--ignore-scripts",
        "--omit=dev",
        "--no-audit",
        "--no-fund",
        "--prefer-offline",
        "--fetch-retries=1",
    ];
    run(npm().arg("ci").args(quiet).current_dir(page))?;
    fs::write(installed, lock).map_err(|error| error.to_string())
}

fn npm() -> Command {
    Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" })
}

fn run(command: &mut Command) -> Result<(), String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|error| format!("{name} could not be started: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    Err(format!("{name} failed ({}): {}", output.status, String::from_utf8_lossy(&output.stderr).trim()))
}

/// A Rust expression that embeds the bundle.
fn included(folder: &Path) -> String {
    let files = FILES.map(|name| {
        let path = |name: &str| folder.join(name).display().to_string();
        format!(
            "File {{ plain: include_bytes!({:?}), zipped: include_bytes!({:?}) }}",
            path(name),
            path(&format!("{name}.gz"))
        )
    });
    format!("Ok([{}])", files.join(", "))
}
