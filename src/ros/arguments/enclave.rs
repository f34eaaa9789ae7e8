//! The folder of an enclave, as `ros2 security` makes it, and whether the middleware can use and honour what is in it.
//!
//! What is examined are the limits of RustDDS 0.15.1 (`.github/upstream.md`), by name, and what a person gets wrong
//! most. Signatures, permissions and domains are verified by the middleware when it opens.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::path::PathBuf;

use openssl::asn1::Asn1Time;
use openssl::nid::Nid;
use openssl::pkey::{HasPublic, PKey, PKeyRef, Private};
use openssl::x509::X509;

use super::security::{Fault, Gravity, ROOT, fault_of_name};

const CERTIFICATE: &str = "cert.pem";
const KEY: &str = "key.pem";
const GOVERNANCE: &str = "governance.p7s";
const REVOCATIONS: &str = "crl.pem";
/// Elements of the governance.
const DATA: &str = "data_protection_kind";
const METADATA: &str = "metadata_protection_kind";
/// Largest file that is read \[B\]; those of a keystore have some kilobytes.
const LARGEST: u64 = 1 << 20;
/// Keys that the middleware signs with: RSA is refused by it, other curves are unknown to it.
const CURVE: Nid = Nid::X9_62_PRIME256V1;
const CURVE_HELP: &str = "make the keystore with EC keys of the curve prime256v1, as `ros2 security` does";

/// The folder of an enclave in a keystore.
pub fn folder(keystore: Option<&Path>, name: &str) -> Result<PathBuf, Fault> {
    let Some(keystore) = keystore else {
        let help = "set it to the folder that `ros2 security create_keystore` made";
        return Err(fault("ROS_SECURITY_KEYSTORE", "is not set", help));
    };
    if let Some(reason) = fault_of_name(name) {
        let help = "name it as in `ros2 security create_enclave`: /fleet/robot_7";
        return Err(fault(format!("enclave {name}"), reason, help));
    }
    let enclaves = keystore.join("enclaves");
    let folder = if name == ROOT { enclaves } else { enclaves.join(&name[1..]) };
    let help = "make it with `ros2 security create_enclave`, or name another by --enclave";
    if folder.is_dir() {
        Ok(folder)
    } else {
        Err(fault(folder.display(), "is no folder of an enclave", help))
    }
}

/// Faults in the files of an enclave, the gravest first.
pub fn faults(folder: &Path) -> Vec<Fault> {
    let mut faults = Vec::new();
    let mut found = |checked: Result<(), Fault>| faults.extend(checked.err());
    let key = key(folder);
    for authority in ["identity_ca.cert.pem", "permissions_ca.cert.pem"] {
        found(certificate(folder, authority).map(drop));
    }
    found(certificate(folder, CERTIFICATE).and_then(|certificate| match &key {
        Ok(key) => matches(folder, &certificate, key),
        Err(_) => Ok(()),
    }));
    found(key.map(drop));
    found(read(folder, "permissions.p7s").map(drop));
    found(revocations(folder));
    match governance(folder) {
        Ok(rules) => faults.extend(weaknesses(folder, &rules).chain(lossy(folder, &rules))),
        Err(fault) => faults.push(fault),
    }
    // Stable: within each kind they stay in the order of the files.
    faults.sort_by_key(|fault| fault.gravity);
    faults
}

/// A fault that leaves no keys to use.
fn fault(place: impl ToString, reason: impl ToString, help: &'static str) -> Fault {
    Fault { place: place.to_string(), reason: reason.to_string(), help, gravity: Gravity::Unusable }
}

fn read(folder: &Path, name: &str) -> Result<Vec<u8>, Fault> {
    let path = folder.join(name);
    let help = "make the enclave with `ros2 security create_enclave`, or give this process its files to read";
    let refused = |reason: &dyn ToString| fault(path.display(), reason.to_string(), help);
    // A pipe or a device may never end, or never begin.
    if !path.metadata().map_err(|error| refused(&error))?.is_file() {
        return Err(refused(&"is no file"));
    }
    let mut bytes = Vec::new();
    let file = File::open(&path).map_err(|error| refused(&error))?;
    file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(|error| refused(&error))?;
    if bytes.len() as u64 > LARGEST { Err(refused(&"is larger than 1 MiB")) } else { Ok(bytes) }
}

fn is_of_curve<T: HasPublic>(key: &PKeyRef<T>) -> bool {
    key.ec_key().is_ok_and(|key| key.group().curve_name() == Some(CURVE))
}

fn certificate(folder: &Path, name: &str) -> Result<X509, Fault> {
    let bytes = read(folder, name)?;
    let refused = |reason, help| fault(folder.join(name).display(), reason, help);
    let help = "make the enclave anew with `ros2 security create_enclave`";
    let certificate = X509::from_pem(&bytes).map_err(|_| refused("is no X.509 certificate in PEM", help))?;
    let now = Asn1Time::days_from_now(0).map_err(|_| refused("has no time to compare with", help))?;
    if certificate.not_after() < now || certificate.not_before() > now {
        let help = "make a certificate for these days, or set the computer's clock";
        return Err(refused("is not valid today", help));
    }
    let is_known = certificate.public_key().is_ok_and(|key| is_of_curve(&key));
    if is_known { Ok(certificate) } else { Err(refused("its key is RSA or of an unknown curve", CURVE_HELP)) }
}

fn key(folder: &Path) -> Result<PKey<Private>, Fault> {
    let bytes = read(folder, KEY)?;
    let refused = |reason, help| fault(folder.join(KEY).display(), reason, help);
    let text = String::from_utf8_lossy(&bytes);
    // Before OpenSSL could ask for the password on the terminal.
    if text.contains("ENCRYPTED") {
        let help =
            "keep a key without a password: `openssl pkcs8 -topk8 -nocrypt -in key.pem -out plain.pem`";
        return Err(refused("is encrypted, and no password is read", help));
    }
    let help = "write it as PKCS #8: `openssl pkcs8 -topk8 -nocrypt -in key.pem -out pkcs8.pem`";
    if !text.contains("-----BEGIN PRIVATE KEY-----") {
        return Err(refused("is no private key in PKCS #8", help));
    }
    let key = PKey::private_key_from_pem(&bytes).map_err(|_| refused("is no private key in PEM", help))?;
    if is_of_curve(&key) { Ok(key) } else { Err(refused("is RSA or of an unknown curve", CURVE_HELP)) }
}

fn matches(folder: &Path, certificate: &X509, key: &PKey<Private>) -> Result<(), Fault> {
    if certificate.public_key().is_ok_and(|public| public.public_eq(key)) {
        return Ok(());
    }
    let help = "copy both from the same enclave";
    Err(fault(folder.join(KEY).display(), "is not the key of cert.pem", help))
}

/// The rules of the governance, without comments.
fn governance(folder: &Path) -> Result<String, Fault> {
    let rules = without_comments(&String::from_utf8_lossy(&read(folder, GOVERNANCE)?));
    if values(&rules, DATA).is_empty() {
        let help = "sign it so that its XML stays readable: `openssl smime -sign -text`";
        let place = folder.join(GOVERNANCE);
        return Err(fault(place.display(), "holds no data_protection_kind in the clear", help));
    }
    Ok(rules)
}

/// The middleware loses samples whose payload is protected by itself.
fn lossy(folder: &Path, rules: &str) -> Option<Fault> {
    let kind = values(rules, DATA).into_iter().find(|kind| kind != "NONE")?;
    Some(Fault {
        reason: format!(
            "data_protection_kind is {kind}, under which RustDDS loses each sample whose length is no \
             multiple of four, and everything reliable after it"
        ),
        place: folder.join(GOVERNANCE).display().to_string(),
        help: "set data_protection_kind to NONE and leave metadata_protection_kind ENCRYPT, which encrypts \
               the data too, and sign it anew",
        gravity: Gravity::Dishonoured,
    })
}

/// Protections that the rules leave open, each once; whichever domains and topics they are for.
fn weaknesses(folder: &Path, rules: &str) -> impl Iterator<Item = Fault> {
    let is_encrypted = |kind: &String| kind.starts_with("ENCRYPT");
    let is_wrapped = values(rules, "rtps_protection_kind").iter().all(is_encrypted);
    let is_open = |rule: &str| {
        values(rule, DATA).iter().any(|kind| kind == "NONE")
            && !values(rule, METADATA).iter().all(is_encrypted)
    };
    let mut reasons = Vec::new();
    if !is_wrapped && rules.split("<topic_rule").skip(1).any(is_open) {
        let reason = "metadata_protection_kind is not ENCRYPT and data_protection_kind is NONE for some topics: their \
                      samples are sent readable by all";
        reasons.push(reason.to_owned());
    }
    let is_true = |value: &String| ["true", "1"].contains(&value.as_str());
    if values(rules, "allow_unauthenticated_participants").iter().any(is_true) {
        reasons.push("allow_unauthenticated_participants is true: peers without keys are let in".to_owned());
    }
    for switch in ["enable_join_access_control", "enable_read_access_control", "enable_write_access_control"]
    {
        if !values(rules, switch).iter().all(is_true) {
            reasons.push(format!("{switch} is false for some: their permissions are not looked at"));
        }
    }
    let place = folder.join(GOVERNANCE).display().to_string();
    let help = "protect it as `ros2 security create_keystore` does, and sign it anew";
    reasons.into_iter().map(move |reason| Fault {
        place: place.clone(),
        reason,
        help,
        gravity: Gravity::Weak,
    })
}

/// The middleware reads no list of revoked certificates.
fn revocations(folder: &Path) -> Result<(), Fault> {
    let path = folder.join(REVOCATIONS);
    // A link that leads nowhere was meant to be one.
    if path.symlink_metadata().is_err() {
        return Ok(());
    }
    Err(Fault {
        place: path.display().to_string(),
        reason: "certificates that it revokes would be taken: RustDDS reads no revocation list".into(),
        help: "make a keystore with another CA for the enclaves that stay, and remove crl.pem",
        gravity: Gravity::Dishonoured,
    })
}

/// Texts of all elements of this name.
fn values(xml: &str, element: &str) -> Vec<String> {
    let open = format!("<{element}");
    let value = |rest: &str| rest.split('>').nth(1)?.split('<').next().map(|text| text.trim().to_owned());
    xml.split(&open).skip(1).filter_map(value).collect()
}

fn without_comments(xml: &str) -> String {
    let mut parts = xml.split("<!--");
    let first = parts.next().unwrap_or_default().to_owned();
    // A comment without an end hides the rest.
    parts.filter_map(|part| part.split_once("-->")).fold(first, |text, (_, rest)| text + rest)
}
