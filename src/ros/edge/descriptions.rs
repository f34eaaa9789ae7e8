//! Descriptions of a node's messages, for peers without their files: `~/get_type_description`.

use super::{EdgeError, Node, Service};
use crate::messages::said;
use crate::messages::type_description_interfaces::{
    GetTypeDescription, GetTypeDescriptionRequest, GetTypeDescriptionResponse, TypeDescription,
};

/// Descriptions behind their service.
pub struct TypeDescriptions(Service<GetTypeDescription>);

impl TypeDescriptions {
    /// Describes the messages of the topics of this program.
    ///
    /// # Errors
    /// As [`Node::service`].
    pub fn new(node: &Node) -> Result<Self, EdgeError> {
        Ok(Self(node.service(&node.private("get_type_description")?)?))
    }

    /// Answers the requests since the last call.
    pub fn serve(&self) {
        self.0.serve(|request| answer(&request).unwrap_or_else(refusal));
    }
}

fn refusal(failure_reason: String) -> GetTypeDescriptionResponse {
    GetTypeDescriptionResponse { failure_reason, ..GetTypeDescriptionResponse::default() }
}

/// Says why where there is no description.
fn answer(request: &GetTypeDescriptionRequest) -> Result<GetTypeDescriptionResponse, String> {
    let GetTypeDescriptionRequest { type_name, type_hash, include_type_sources } = request;
    let known = type_name.split_once("/msg/").map(|(package, name)| format!("{package}/{name}"));
    let described = known.and_then(|name| TypeDescription::of(&name));
    let type_description = described.ok_or_else(|| {
        format!("`{}` is no message of a topic of this node: give package/msg/Name", said(type_name))
    })?;
    let own = type_description.hash();
    if !type_hash.is_empty() && *type_hash != own {
        return Err(format!("{type_name} is {own} here, not `{}`", said(type_hash)));
    }
    let type_sources = if *include_type_sources { type_description.sources() } else { Vec::new() };
    Ok(GetTypeDescriptionResponse {
        successful: true,
        type_description,
        type_sources,
        ..GetTypeDescriptionResponse::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(type_name: &str, type_hash: &str) -> Result<GetTypeDescriptionResponse, String> {
        let (type_name, type_hash) = (type_name.to_owned(), type_hash.to_owned());
        answer(&GetTypeDescriptionRequest { type_name, type_hash, include_type_sources: true })
    }

    #[test]
    fn a_message_is_described_with_all_that_it_contains() {
        let answer = asked("geometry_msgs/msg/PoseStamped", "").expect("known");
        let names = answer.type_description.referenced_type_descriptions.iter().map(|one| &one.type_name[..]);
        let expected = [
            "builtin_interfaces/msg/Time",
            "geometry_msgs/msg/Point",
            "geometry_msgs/msg/Pose",
            "geometry_msgs/msg/Quaternion",
            "std_msgs/msg/Header",
        ];
        assert!(names.eq(expected));
        assert_eq!(answer.type_sources.len(), 6);
        assert!(answer.type_sources[0].raw_file_contents.starts_with("std_msgs/Header header\nPose pose"));
        let again = asked("geometry_msgs/msg/PoseStamped", &answer.type_description.hash());
        assert_eq!(again, Ok(answer));
    }

    #[test]
    fn other_types_and_other_hashes_are_refused_with_the_reason() {
        let unknown = asked("geometry_msgs/msg/Wrench\n[INFO] forged", "").expect_err("unknown");
        assert!(unknown.contains("no message of a topic") && !unknown.contains('\n'), "{unknown}");
        let other = asked("std_msgs/msg/Header", "RIHS01_00").expect_err("another");
        assert!(other.contains("RIHS01_f49fb3") && other.contains("`RIHS01_00`"), "{other}");
    }
}
