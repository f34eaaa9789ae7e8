//! `sensor_msgs`: only what a marker contains.

use serde::{Deserialize, Serialize};

use super::std_msgs::Header;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CompressedImage {
    pub header: Header,
    pub format: String,
    pub data: Vec<u8>,
}

super::messages!("sensor_msgs": CompressedImage);
