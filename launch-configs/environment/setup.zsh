# Source this so that `ros2 run flockform flockform` and `ros2 launch flockform ...` find this prefix.
_flockform_prefix="${${(%):-%x}:A:h}"
case ":${AMENT_PREFIX_PATH:-}:" in
  *":${_flockform_prefix}:"*) ;;
  *) export AMENT_PREFIX_PATH="${_flockform_prefix}${AMENT_PREFIX_PATH:+:${AMENT_PREFIX_PATH}}" ;;
esac
unset _flockform_prefix
