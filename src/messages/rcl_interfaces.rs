//! Package `rcl_interfaces`: parameters, and lines of logs.

use serde::{Deserialize, Serialize};

use super::builtin_interfaces::Time;
use super::{messages, service};

/// `msg/ParameterValue`: the field that `kind` names counts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterValue {
    /// `msg/ParameterType`: 0 not set, 1 bool, 2 integer, 3 double, 4 string, 5 to 9 arrays of byte, bool,
    /// integer, double, string.
    pub kind: u8,
    pub bool_value: bool,
    pub integer_value: i64,
    pub double_value: f64,
    pub string_value: String,
    pub byte_array_value: Vec<u8>,
    pub bool_array_value: Vec<bool>,
    pub integer_array_value: Vec<i64>,
    pub double_array_value: Vec<f64>,
    pub string_array_value: Vec<String>,
}

/// `msg/Parameter`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    pub name: String,
    pub value: ParameterValue,
}

/// `msg/SetParametersResult`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetParametersResult {
    pub successful: bool,
    pub reason: String,
}

/// `msg/FloatingPointRange`: both ends included; a step of 0 allows every value between.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FloatingPointRange {
    pub from_value: f64,
    pub to_value: f64,
    pub step: f64,
}

/// `msg/IntegerRange`: both ends included; a step of 0 allows every value between.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct IntegerRange {
    pub from_value: i64,
    pub to_value: i64,
    pub step: u64,
}

/// `msg/ParameterDescriptor`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterDescriptor {
    pub name: String,
    pub kind: u8,
    pub description: String,
    pub additional_constraints: String,
    pub read_only: bool,
    pub dynamic_typing: bool,
    /// None or one.
    pub floating_point_range: Vec<FloatingPointRange>,
    /// None or one.
    pub integer_range: Vec<IntegerRange>,
}

/// `msg/ParameterEvent`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ParameterEvent {
    pub stamp: Time,
    /// Fully qualified name.
    pub node: String,
    pub new_parameters: Vec<Parameter>,
    pub changed_parameters: Vec<Parameter>,
    pub deleted_parameters: Vec<Parameter>,
}

/// `msg/Log`: a line of a node's log.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Log {
    pub stamp: Time,
    /// One of the constants.
    pub level: u8,
    /// Name of the logger.
    pub name: String,
    pub msg: String,
    pub file: String,
    pub function: String,
    pub line: u32,
}

impl Log {
    pub const DEBUG: u8 = 10;
    pub const INFO: u8 = 20;
    pub const WARN: u8 = 30;
    pub const ERROR: u8 = 40;
    pub const FATAL: u8 = 50;
}

messages!("rcl_interfaces": ParameterEvent, Log);

/// Request of [`GetParameters`], [`GetParameterTypes`] and [`DescribeParameters`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Names {
    pub names: Vec<String>,
}

service!(GetParameters, "rcl_interfaces", Names => GetParametersResponse);

/// Response of [`GetParameters`], one value per name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GetParametersResponse {
    pub values: Vec<ParameterValue>,
}

service!(GetParameterTypes, "rcl_interfaces", Names => GetParameterTypesResponse);

/// Response of [`GetParameterTypes`], one type per name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetParameterTypesResponse {
    pub types: Vec<u8>,
}

service!(DescribeParameters, "rcl_interfaces", Names => DescribeParametersResponse);

/// Response of [`DescribeParameters`], one descriptor per name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DescribeParametersResponse {
    pub descriptors: Vec<ParameterDescriptor>,
}

service!(ListParameters, "rcl_interfaces", ListParametersRequest => ListParametersResponse);

/// Request of [`ListParameters`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListParametersRequest {
    /// Groups to list; none: all.
    pub prefixes: Vec<String>,
    /// How many dots deep below a prefix \[1\]; 0: all.
    pub depth: u64,
}

/// Response of [`ListParameters`]: `msg/ListParametersResult`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListParametersResponse {
    pub names: Vec<String>,
    pub prefixes: Vec<String>,
}

/// Request of [`SetParameters`] and [`SetParametersAtomically`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    pub parameters: Vec<Parameter>,
}

service!(SetParameters, "rcl_interfaces", Settings => SetParametersResponse);

/// Response of [`SetParameters`], one result per setting.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetParametersResponse {
    pub results: Vec<SetParametersResult>,
}

service!(SetParametersAtomically, "rcl_interfaces", Settings => SetParametersAtomicallyResponse);

/// Response of [`SetParametersAtomically`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetParametersAtomicallyResponse {
    pub result: SetParametersResult,
}

/// `msg/LoggerLevel`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LoggerLevel {
    pub name: String,
    /// 0 unknown, 10 debug, 20 info, 30 warn, 40 error, 50 fatal.
    pub level: u32,
}

service!(GetLoggerLevels, "rcl_interfaces", Names => GetLoggerLevelsResponse);

/// Response of [`GetLoggerLevels`], one level per name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GetLoggerLevelsResponse {
    pub levels: Vec<LoggerLevel>,
}

service!(SetLoggerLevels, "rcl_interfaces", SetLoggerLevelsRequest => SetLoggerLevelsResponse);

/// Request of [`SetLoggerLevels`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetLoggerLevelsRequest {
    pub levels: Vec<LoggerLevel>,
}

/// Response of [`SetLoggerLevels`], one `msg/SetLoggerLevelsResult` per level: its fields are those of
/// [`SetParametersResult`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetLoggerLevelsResponse {
    pub results: Vec<SetParametersResult>,
}
