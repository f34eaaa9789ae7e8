//! Package `rcl_interfaces`: parameters, and lines of logs.

use super::builtin_interfaces::Time;
use super::{messages, services, structs};

messages! { "rcl_interfaces";
    /// The field that `kind` names counts.
    ParameterValue {
        /// `msg/ParameterType`: 0 not set, 1 bool, 2 integer, 3 double, 4 string, 5 to 9 arrays of byte, bool,
        /// integer, double, string.
        kind: u8,
        bool_value: bool,
        integer_value: i64,
        double_value: f64,
        string_value: String,
        byte_array_value: Vec<u8>,
        bool_array_value: Vec<bool>,
        integer_array_value: Vec<i64>,
        double_array_value: Vec<f64>,
        string_array_value: Vec<String>,
    }

    Parameter { name: String, value: ParameterValue }
    SetParametersResult { successful: bool, reason: String }

    /// Both ends included; a step of 0 allows every value between.
    #[derive(Copy)] FloatingPointRange { from_value: f64, to_value: f64, step: f64 }

    /// Both ends included; a step of 0 allows every value between.
    #[derive(Copy)] IntegerRange { from_value: i64, to_value: i64, step: u64 }

    ParameterDescriptor {
        name: String,
        kind: u8,
        description: String,
        additional_constraints: String,
        read_only: bool,
        dynamic_typing: bool,
        /// None or one.
        floating_point_range: Vec<FloatingPointRange>,
        /// None or one.
        integer_range: Vec<IntegerRange>,
    }

    ParameterEvent {
        stamp: Time,
        /// Fully qualified name.
        node: String,
        new_parameters: Vec<Parameter>,
        changed_parameters: Vec<Parameter>,
        deleted_parameters: Vec<Parameter>,
    }

    /// A line of a node's log.
    Log {
        stamp: Time,
        /// One of the constants.
        level: u8,
        /// Name of the logger.
        name: String,
        msg: String,
        file: String,
        function: String,
        line: u32,
    }

    LoggerLevel {
        name: String,
        /// 0 unknown, 10 debug, 20 info, 30 warn, 40 error, 50 fatal.
        level: u32,
    }
}

impl Log {
    pub const DEBUG: u8 = 10;
    pub const INFO: u8 = 20;
    pub const WARN: u8 = 30;
    pub const ERROR: u8 = 40;
    pub const FATAL: u8 = 50;
}

structs! {
    /// Request of [`GetParameters`], [`GetParameterTypes`] and [`DescribeParameters`].
    Names { names: Vec<String> }

    /// Response of [`GetParameters`], one value per name.
    GetParametersResponse { values: Vec<ParameterValue> }

    /// Response of [`GetParameterTypes`], one type per name.
    GetParameterTypesResponse { types: Vec<u8> }

    /// Response of [`DescribeParameters`], one descriptor per name.
    DescribeParametersResponse { descriptors: Vec<ParameterDescriptor> }

    /// Request of [`ListParameters`].
    ListParametersRequest {
        /// Groups to list; none: all.
        prefixes: Vec<String>,
        /// How many dots deep below a prefix \[1\]; 0: all.
        depth: u64,
    }

    /// Response of [`ListParameters`]: `msg/ListParametersResult`.
    ListParametersResponse { names: Vec<String>, prefixes: Vec<String> }

    /// Request of [`SetParameters`] and [`SetParametersAtomically`].
    Settings { parameters: Vec<Parameter> }

    /// Response of [`SetParameters`], one result per setting.
    SetParametersResponse { results: Vec<SetParametersResult> }

    /// Response of [`SetParametersAtomically`].
    SetParametersAtomicallyResponse { result: SetParametersResult }

    /// Response of [`GetLoggerLevels`], one level per name.
    GetLoggerLevelsResponse { levels: Vec<LoggerLevel> }

    /// Request of [`SetLoggerLevels`].
    SetLoggerLevelsRequest { levels: Vec<LoggerLevel> }

    /// Response of [`SetLoggerLevels`], one `msg/SetLoggerLevelsResult` per level: its fields are those of
    /// [`SetParametersResult`].
    SetLoggerLevelsResponse { results: Vec<SetParametersResult> }
}

services! { "rcl_interfaces";
    GetParameters: Names => GetParametersResponse;
    GetParameterTypes: Names => GetParameterTypesResponse;
    DescribeParameters: Names => DescribeParametersResponse;
    ListParameters: ListParametersRequest => ListParametersResponse;
    SetParameters: Settings => SetParametersResponse;
    SetParametersAtomically: Settings => SetParametersAtomicallyResponse;
    GetLoggerLevels: Names => GetLoggerLevelsResponse;
    SetLoggerLevels: SetLoggerLevelsRequest => SetLoggerLevelsResponse;
}
