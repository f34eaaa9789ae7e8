//! `tf2_msgs`: what `/tf` carries.

use serde::{Deserialize, Serialize};

use super::geometry_msgs::TransformStamped;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TFMessage {
    pub transforms: Vec<TransformStamped>,
}

super::messages!("tf2_msgs": TFMessage);
