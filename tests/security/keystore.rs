//! Keystores in the layout of `ros2 security`, made by the command `openssl` alone.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The governance that `ros2 security` writes, but for the payloads: encrypting them as well loses samples.
pub const GOVERNANCE: Governance = Governance {
    rtps: "SIGN",
    metadata: "ENCRYPT",
    data: "NONE",
    admits_all: false,
    reads_permissions: true,
};

/// What protects a domain.
#[derive(Clone, Copy)]
pub struct Governance {
    pub rtps: &'static str,
    pub metadata: &'static str,
    pub data: &'static str,
    /// Whether those without keys are let in.
    pub admits_all: bool,
    pub reads_permissions: bool,
}

/// All that nodes need.
pub const EVERYTHING: [&str; 4] = ["ros_discovery_info", "rt/*", "rq/*", "rr/*"];

pub struct Keystore {
    pub folder: PathBuf,
    domain: u16,
}

/// Runs `openssl` in a folder.
pub fn openssl(folder: &Path, line: &str) {
    let ended = Command::new("openssl").args(line.split(' ')).current_dir(folder).output().expect("openssl");
    assert!(ended.status.success(), "openssl {line}: {}", String::from_utf8_lossy(&ended.stderr));
}

const NEW_KEY: &str = "genpkey -algorithm EC -pkeyopt ec_paramgen_curve:prime256v1 -out";

impl Keystore {
    /// With a governance for this domain.
    pub fn make(folder: &Path, domain: u16, governance: Governance) -> Self {
        for part in ["public", "private", "enclaves"] {
            std::fs::create_dir_all(folder.join(part)).expect("a folder");
        }
        openssl(folder, &format!("{NEW_KEY} private/ca.key.pem"));
        openssl(
            folder,
            "req -x509 -new -key private/ca.key.pem -sha256 -days 30 -subj /CN=sros2CA -out public/ca.cert.pem",
        );
        let this = Self { folder: folder.to_owned(), domain };
        this.govern(governance);
        this
    }

    /// Signs another governance.
    pub fn govern(&self, governance: Governance) {
        self.sign("enclaves/governance", &self.governance(governance));
    }

    /// Writes a document and signs it.
    pub fn sign(&self, name: &str, xml: &str) {
        std::fs::write(self.folder.join(format!("{name}.xml")), xml).expect("written");
        let keys = "-signer public/ca.cert.pem -inkey private/ca.key.pem";
        openssl(&self.folder, &format!("smime -sign -text -in {name}.xml -out {name}.p7s {keys}"));
    }

    /// Makes the enclave `/NAME`, which may publish some topics and subscribe to some; returns its folder.
    pub fn enclave(&self, name: &str, publish: &[&str], subscribe: &[&str]) -> PathBuf {
        let own = format!("enclaves/{name}");
        let folder = self.folder.join(&own);
        std::fs::create_dir_all(&folder).expect("a folder");
        let up = "../".repeat(own.split('/').count());
        for authority in ["identity_ca", "permissions_ca"] {
            let link = folder.join(format!("{authority}.cert.pem"));
            symlink(format!("{up}public/ca.cert.pem"), link).expect("a link");
        }
        symlink(format!("{up}enclaves/governance.p7s"), folder.join("governance.p7s")).expect("a link");
        openssl(&self.folder, &format!("{NEW_KEY} {own}/key.pem"));
        let subject = format!("/CN=\\/{}", name.replace('/', "\\/"));
        openssl(
            &self.folder,
            &format!(
                "req -x509 -new -key {own}/key.pem -CA public/ca.cert.pem -CAkey private/ca.key.pem -sha256 \
                 -days 30 -subj {subject} -out {own}/cert.pem"
            ),
        );
        let grant = self.grant(name, ["2020-01-01T00:00:00", "2049-01-01T00:00:00"], publish, subscribe);
        self.sign(&format!("{own}/permissions"), &permissions(&grant));
        folder
    }

    fn governance(&self, governance: Governance) -> String {
        let Governance { rtps, metadata, data, admits_all, reads_permissions } = governance;
        format!(
            r#"<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      <domains><id>{}</id></domains>
      <allow_unauthenticated_participants>{admits_all}</allow_unauthenticated_participants>
      <enable_join_access_control>{reads_permissions}</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>{rtps}</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>{reads_permissions}</enable_read_access_control>
          <enable_write_access_control>{reads_permissions}</enable_write_access_control>
          <metadata_protection_kind>{metadata}</metadata_protection_kind>
          <!-- <data_protection_kind>ENCRYPT</data_protection_kind> -->
          <data_protection_kind>{data}</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
"#,
            self.domain
        )
    }

    /// Permits an enclave everything for this long, and then what it may publish and subscribe to in these lists.
    pub fn permit_until(&self, name: &str, end: Duration, [publish, subscribe]: [&[&str]; 2]) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("a clock after 1970").as_secs();
        let date = |seconds: u64| {
            let mut command = Command::new("date");
            let command = command.args(["-u", "-d", &format!("@{seconds}"), "+%Y-%m-%dT%H:%M:%S"]);
            let said = command.output().expect("the command date").stdout;
            String::from_utf8(said).expect("text").trim().to_owned()
        };
        let end = date(now + end.as_secs());
        let grants = [
            self.grant(name, ["2020-01-01T00:00:00", &end], &EVERYTHING, &EVERYTHING),
            self.grant(name, [&end, "2049-01-01T00:00:00"], publish, subscribe),
        ];
        self.sign(&format!("enclaves/{name}/permissions"), &permissions(&grants.concat()));
    }

    fn grant(&self, name: &str, [begin, end]: [&str; 2], publish: &[&str], subscribe: &[&str]) -> String {
        let topics = |names: &[&str]| -> String {
            names.iter().map(|name| format!("<topic>{name}</topic>")).collect()
        };
        format!(
            r#"    <grant name="/{name}">
      <subject_name>CN=/{name}</subject_name>
      <validity><not_before>{begin}</not_before><not_after>{end}</not_after></validity>
      <allow_rule>
        <domains><id>{}</id></domains>
        <publish><topics>{}</topics></publish>
        <subscribe><topics>{}</topics></subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
"#,
            self.domain,
            topics(publish),
            topics(subscribe)
        )
    }
}

/// The document of these grants.
fn permissions(grants: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
{grants}  </permissions>
</dds>
"#
    )
}
