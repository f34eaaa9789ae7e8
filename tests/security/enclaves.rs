//! What is wrong with an enclave is named: a reason to end under `Enforce`, a warning otherwise.

use std::path::Path;

use flockform::ros::arguments::{RosArgumentError, RosArguments, Security};

use super::keystore::*;

/// How a process takes part that is started so.
fn settled(
    keystore: &Path,
    strategy: &str,
    enclave: &str,
    more: &[(&str, &str)],
) -> Result<Security, RosArgumentError> {
    let keystore = keystore.to_str().expect("text");
    let set = [
        ("ROS_SECURITY_ENABLE", "true"),
        ("ROS_SECURITY_STRATEGY", strategy),
        ("ROS_SECURITY_KEYSTORE", keystore),
    ];
    let all: Vec<(&str, &str)> = more.iter().chain(&set).copied().collect();
    let look_up = |name: &str| all.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned());
    let arguments = ["--ros-args", "-e", enclave].map(str::to_owned);
    RosArguments::parse(arguments, &look_up).map(|(_, ros)| ros.security)
}

/// A fault: how it comes about, words that name it, and whether the keys stay usable.
type Case<'a> = (&'a dyn Fn(&Keystore, &Path), &'a str, &'a str, bool);

#[test]
#[ignore = "needs the command openssl"]
fn each_fault_ends_an_enforced_process_by_name_and_is_a_warning_to_another() {
    let remove = |name: &'static str| {
        move |_: &Keystore, enclave: &Path| {
            std::fs::remove_file(enclave.join(name)).expect("removed");
        }
    };
    let write = |name: &'static str, text: String| {
        move |_: &Keystore, enclave: &Path| {
            let path = enclave.join(name);
            let _ = std::fs::remove_file(&path);
            std::fs::write(path, &text).expect("written");
        }
    };
    let govern =
        |data| move |keystore: &Keystore, _: &Path| keystore.govern(Governance { data, ..GOVERNANCE });
    let encrypt = |_: &Keystore, enclave: &Path| {
        openssl(enclave, "pkcs8 -topk8 -in key.pem -passout pass:secret -out locked.pem");
        std::fs::rename(enclave.join("locked.pem"), enclave.join("key.pem")).expect("renamed");
    };
    let sec1 = |_: &Keystore, enclave: &Path| {
        openssl(enclave, "ec -in key.pem -out sec1.pem");
        std::fs::rename(enclave.join("sec1.pem"), enclave.join("key.pem")).expect("renamed");
    };
    let rsa_key = |_: &Keystore, enclave: &Path| {
        openssl(enclave, "genpkey -algorithm RSA -out key.pem");
    };
    // Made anew with another key, and signed by it.
    let with_key = |key: &'static str, name: &'static str| {
        move |_: &Keystore, enclave: &Path| {
            openssl(enclave, &format!("genpkey {key} -out other.pem"));
            let _ = std::fs::remove_file(enclave.join(name));
            let line = "req -x509 -new -key other.pem -sha256 -days 9 -subj /CN=x -out";
            openssl(enclave, &format!("{line} {name}"));
        }
    };
    let (rsa, wide) = ("-algorithm RSA", "-algorithm EC -pkeyopt ec_paramgen_curve:secp384r1");
    let rsa_certificate = with_key(rsa, "cert.pem");
    let rsa_authority = with_key(rsa, "permissions_ca.cert.pem");
    let curve = with_key(wide, "cert.pem");
    let another = with_key("-algorithm EC -pkeyopt ec_paramgen_curve:prime256v1", "cert.pem");
    let late = |_: &Keystore, enclave: &Path| {
        openssl(enclave, "req -new -key key.pem -subj /CN=x -out x.csr");
        openssl(enclave, "x509 -req -in x.csr -signkey key.pem -days -1 -out cert.pem");
    };
    let pipe = |_: &Keystore, enclave: &Path| {
        std::fs::remove_file(enclave.join("cert.pem")).expect("removed");
        let made = std::process::Command::new("mkfifo").arg(enclave.join("cert.pem")).status();
        assert!(made.expect("mkfifo").success());
    };
    let opaque = |keystore: &Keystore, _: &Path| {
        let keys = "-signer public/ca.cert.pem -inkey private/ca.key.pem";
        let line = "smime -sign -nodetach -in enclaves/governance.xml -out enclaves/governance.p7s";
        openssl(&keystore.folder, &format!("{line} {keys}"));
    };
    let cases: [Case<'_>; 21] = [
        (&remove("identity_ca.cert.pem"), "identity_ca.cert.pem", "No such file", false),
        (&remove("permissions_ca.cert.pem"), "permissions_ca.cert.pem", "No such file", false),
        (&remove("cert.pem"), "cert.pem", "No such file", false),
        (&remove("key.pem"), "key.pem", "No such file", false),
        (&remove("governance.p7s"), "governance.p7s", "No such file", false),
        (&remove("permissions.p7s"), "permissions.p7s", "No such file", false),
        (&write("crl.pem", String::new()), "crl.pem", "revocation list", true),
        (&write("cert.pem", "nothing".into()), "cert.pem", "no X.509 certificate", false),
        (&write("permissions.p7s", "x".repeat(2 << 20)), "permissions.p7s", "larger than 1 MiB", false),
        (&govern("ENCRYPT"), "governance.p7s", "data_protection_kind is ENCRYPT", true),
        (&govern("SIGN"), "governance.p7s", "data_protection_kind is SIGN", true),
        (&opaque, "governance.p7s", "in the clear", false),
        (&encrypt, "key.pem", "is encrypted", false),
        (&sec1, "key.pem", "PKCS #8", false),
        (&rsa_key, "key.pem", "RSA", false),
        (&rsa_certificate, "cert.pem", "RSA", false),
        (&rsa_authority, "permissions_ca.cert.pem", "RSA", false),
        (&curve, "cert.pem", "curve", false),
        (&late, "cert.pem", "not valid today", false),
        (&another, "key.pem", "not the key of cert.pem", false),
        (&pipe, "cert.pem", "is no file", false),
    ];
    for (spoil, place, reason, is_bearable) in cases {
        let folder = tempfile::tempdir().expect("a folder");
        let keystore = Keystore::make(folder.path(), 0, GOVERNANCE);
        let enclave = keystore.enclave("fleet/one", &EVERYTHING, &EVERYTHING);
        let sound = settled(folder.path(), "Enforce", "/fleet/one", &[]).expect("sound");
        assert_eq!(sound, Security { enclave: Some(enclave.clone()), warnings: vec![] });
        spoil(&keystore, &enclave);
        let refused = settled(folder.path(), "Enforce", "/fleet/one", &[]).expect_err(reason).to_string();
        assert!(refused.contains(place) && refused.contains(reason), "{place} {reason}: {refused}");
        assert!(refused.contains("\n  help: "), "{refused}");
        let borne = settled(folder.path(), "Permissive", "/fleet/one", &[]).expect("permissive");
        assert_eq!(borne.enclave.is_some(), is_bearable, "{place} {reason}");
        let [warning] = &borne.warnings[..] else { panic!("{:?}", borne.warnings) };
        assert!(warning.contains(place) && warning.contains(reason), "{warning}");
        assert_eq!(warning.contains("in the clear ("), !is_bearable, "{warning}");
    }
}

#[test]
#[ignore = "needs the command openssl"]
fn what_a_governance_leaves_open_is_a_warning_where_security_is_enforced_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let keystore = Keystore::make(folder.path(), 0, GOVERNANCE);
    let enclave = keystore.enclave("one", &EVERYTHING, &EVERYTHING);
    let cases: [(Governance, &[&str]); 6] = [
        (GOVERNANCE, &[]),
        (Governance { metadata: "SIGN", ..GOVERNANCE }, &["sent readable"]),
        (Governance { metadata: "NONE", ..GOVERNANCE }, &["sent readable"]),
        (Governance { metadata: "NONE", rtps: "ENCRYPT", ..GOVERNANCE }, &[]),
        (Governance { admits_all: true, ..GOVERNANCE }, &["allow_unauthenticated_participants is true"]),
        (
            Governance { reads_permissions: false, ..GOVERNANCE },
            &[
                "enable_join_access_control is",
                "enable_read_access_control is",
                "enable_write_access_control is",
            ],
        ),
    ];
    for (governance, words) in cases {
        keystore.govern(governance);
        for strategy in ["Enforce", "Permissive"] {
            let Security { enclave: used, warnings } =
                settled(folder.path(), strategy, "/one", &[]).expect("usable");
            assert_eq!(used.as_ref(), Some(&enclave));
            assert_eq!(warnings.len(), words.len(), "{warnings:?}");
            for (warning, words) in warnings.iter().zip(words) {
                assert!(warning.contains("governance.p7s: ") && warning.contains(words), "{warning}");
            }
        }
    }
}

#[test]
#[ignore = "needs the command openssl"]
fn the_enclave_is_the_root_or_the_argument_s_or_the_override_s() {
    let folder = tempfile::tempdir().expect("a folder");
    let keystore = Keystore::make(folder.path(), 0, GOVERNANCE);
    let [one, two] = ["one", "fleet/two"].map(|name| keystore.enclave(name, &EVERYTHING, &EVERYTHING));
    let enclave = |argument, more: &[(&str, &str)]| {
        settled(folder.path(), "Enforce", argument, more).map(|security| security.enclave)
    };
    assert_eq!(enclave("/one", &[]).expect("sound"), Some(one));
    let by_override = [("ROS_SECURITY_ENCLAVE_OVERRIDE", "/fleet/two")];
    assert_eq!(enclave("/one", &by_override).expect("sound"), Some(two));
    for (argument, more, words) in [
        ("/", &[][..], "enclaves/identity_ca.cert.pem"),
        ("/three", &[], "enclaves/three: is no folder"),
        ("/fleet/two/cert_pem", &[], "is no folder"),
        ("/one", &[("ROS_SECURITY_ENCLAVE_OVERRIDE", "/../one")], "enclave /../one: "),
        ("/one", &[("ROS_SECURITY_ENCLAVE_OVERRIDE", "one")], "begins with a slash"),
        ("/one", &[("ROS_SECURITY_KEYSTORE", "")], "ROS_SECURITY_KEYSTORE: is not set"),
    ] {
        let error = enclave(argument, more).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
    }
}
