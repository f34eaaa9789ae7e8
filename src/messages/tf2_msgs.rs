//! `tf2_msgs`: what `/tf` carries.

use super::geometry_msgs::TransformStamped;
use super::messages;

messages! { "tf2_msgs";
    TFMessage { transforms: Vec<TransformStamped> }
}
