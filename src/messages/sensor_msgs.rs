//! `sensor_msgs`: only what a marker contains.

use super::messages;
use super::std_msgs::Header;

messages! { "sensor_msgs";
    CompressedImage { header: Header, format: String, data: Vec<u8> }
}
