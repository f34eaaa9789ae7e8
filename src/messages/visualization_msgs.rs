//! `visualization_msgs` as of Iron and later: shapes that RViz and Foxglove draw.

use super::builtin_interfaces::Duration;
use super::geometry_msgs::{Point, Pose, Vector3};
use super::messages;
use super::sensor_msgs::CompressedImage;
use super::std_msgs::{ColorRGBA, Header};

messages! { "visualization_msgs";
    /// A place in a texture, each part from 0 to 1.
    #[derive(Copy)] UVCoordinate { u: f32, v: f32 }
    MeshFile { filename: String, data: Vec<u8> }

    /// One shape, or many of a kind.
    Marker {
        header: Header,
        /// With `id`, what the marker is known by: the same two replace it.
        ns: String,
        id: i32,
        /// Shape, one of the constants.
        r#type: i32,
        /// [`Marker::ADD`] (the same as modify), [`Marker::DELETE`] or [`Marker::DELETEALL`].
        action: i32,
        pose: Pose,
        /// Size \[m\]; for lines, `x` is their width.
        scale: Vector3,
        color: ColorRGBA,
        /// How long it stays; zero is forever.
        lifetime: Duration,
        /// Moves with its frame between updates.
        frame_locked: bool,
        /// Points of lines and lists, relative to `pose` \[m\].
        points: Vec<Point>,
        /// One for each point, or none.
        colors: Vec<ColorRGBA>,
        texture_resource: String,
        texture: CompressedImage,
        uv_coordinates: Vec<UVCoordinate>,
        text: String,
        mesh_resource: String,
        mesh_file: MeshFile,
        mesh_use_embedded_materials: bool,
    }

    MarkerArray { markers: Vec<Marker> }
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
