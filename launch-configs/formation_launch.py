"""A whole swarm of one swarm file: simulated robots, and the node that keeps them in formation.

ros2 launch flockform formation_launch.py swarm:=/path/to/swarm.toml
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def in_share(*path):
    return PathJoinSubstitution([FindPackageShare("flockform"), *path])


def generate_launch_description():
    swarm = LaunchConfiguration("swarm")
    use_sim_time = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    return LaunchDescription([
        DeclareLaunchArgument(
            "swarm",
            default_value=in_share("swarms", "square.toml"),
            description="Swarm file: which robots fly, in what shape",
        ),
        DeclareLaunchArgument(
            "parameters",
            default_value=in_share("parameters", "formation.yaml"),
            description="Parameter file of the node",
        ),
        DeclareLaunchArgument(
            "namespace",
            default_value="/",
            description="Namespace of the fleet: of its nodes and topics",
        ),
        DeclareLaunchArgument(
            "use_sim_time",
            default_value="false",
            description="The robots publish /clock, and the node takes the time from it",
        ),
        # All simulated robots are one node.
        Node(
            package="flockform",
            executable="flockform",
            namespace=LaunchConfiguration("namespace"),
            arguments=["robots", swarm],
            parameters=[{"publish_clock": use_sim_time}],
            output="screen",
            respawn=True,
            respawn_delay=2.0,
        ),
        # Not started again where it ends: it sees to that by itself, and another would know of no emergency stop.
        Node(
            package="flockform",
            executable="flockform",
            namespace=LaunchConfiguration("namespace"),
            arguments=["node", swarm],
            parameters=[LaunchConfiguration("parameters"), {"use_sim_time": use_sim_time}],
            output="screen",
        ),
    ])
