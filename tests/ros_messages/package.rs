//! The interface package is complete.

use crate::definition;
use crate::structs::{files, text};

#[test]
fn the_build_file_lists_every_definition() {
    let build = text("CMakeLists.txt");
    for folder in ["msg", "srv"] {
        for file in files(folder) {
            assert!(build.contains(&format!("\"{folder}/{file}\"")), "{folder}/{file} is not built");
        }
    }
}

#[test]
fn the_package_depends_on_every_package_that_its_messages_name() {
    let (package, build) = (text("package.xml"), text("CMakeLists.txt"));
    for file in files("msg") {
        for other in definition::parse(&text(&format!("msg/{file}"))).packages {
            assert!(package.contains(&format!("<depend>{other}</depend>")), "{other} in package.xml");
            assert!(build.contains(&format!("find_package({other} REQUIRED)")), "{other} in CMakeLists.txt");
        }
    }
}
