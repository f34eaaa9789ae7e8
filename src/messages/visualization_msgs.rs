//! `visualization_msgs` as of Iron and later: shapes that RViz and Foxglove draw.

use serde::{Deserialize, Serialize};

use super::builtin_interfaces::Duration;
use super::geometry_msgs::{Point, Pose, Vector3};
use super::sensor_msgs::CompressedImage;
use super::std_msgs::{ColorRGBA, Header};

/// A place in a texture, each part from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UVCoordinate {
    pub u: f32,
    pub v: f32,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshFile {
    pub filename: String,
    pub data: Vec<u8>,
}

/// One shape, or many of a kind.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    pub header: Header,
    /// With `id`, what the marker is known by: the same two replace it.
    pub ns: String,
    pub id: i32,
    /// Shape, one of the constants.
    pub r#type: i32,
    /// [`Marker::ADD`] (the same as modify), [`Marker::DELETE`] or [`Marker::DELETEALL`].
    pub action: i32,
    pub pose: Pose,
    /// Size \[m\]; for lines, `x` is their width.
    pub scale: Vector3,
    pub color: ColorRGBA,
    /// How long it stays; zero is forever.
    pub lifetime: Duration,
    /// Moves with its frame between updates.
    pub frame_locked: bool,
    /// Points of lines and lists, relative to `pose` \[m\].
    pub points: Vec<Point>,
    /// One for each point, or none.
    pub colors: Vec<ColorRGBA>,
    pub texture_resource: String,
    pub texture: CompressedImage,
    pub uv_coordinates: Vec<UVCoordinate>,
    pub text: String,
    pub mesh_resource: String,
    pub mesh_file: MeshFile,
    pub mesh_use_embedded_materials: bool,
}

impl Marker {
    pub const ARROW: i32 = 0;
    pub const CUBE: i32 = 1;
    pub const SPHERE: i32 = 2;
    pub const CYLINDER: i32 = 3;
    pub const LINE_STRIP: i32 = 4;
    pub const LINE_LIST: i32 = 5;
    pub const CUBE_LIST: i32 = 6;
    pub const SPHERE_LIST: i32 = 7;
    pub const POINTS: i32 = 8;
    pub const TEXT_VIEW_FACING: i32 = 9;
    pub const MESH_RESOURCE: i32 = 10;
    pub const TRIANGLE_LIST: i32 = 11;
    pub const ARROW_STRIP: i32 = 12;

    pub const ADD: i32 = 0;
    pub const MODIFY: i32 = 0;
    pub const DELETE: i32 = 2;
    pub const DELETEALL: i32 = 3;
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MarkerArray {
    pub markers: Vec<Marker>,
}

super::messages!("visualization_msgs": UVCoordinate, MeshFile, Marker, MarkerArray);
