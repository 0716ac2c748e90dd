# Include this after the find_package calls of an interface package.
#
# ROS 2 wheels export targets that name the Python include folder of the machine they were built on. CMake
# refuses targets with folders that do not exist, so this machine's folder takes their place. On a ROS 2 of a
# distribution the two are the same.
find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Module)
get_property(_imported_targets DIRECTORY PROPERTY IMPORTED_TARGETS)
foreach(_target IN LISTS _imported_targets)
  if(_target MATCHES "__rosidl_generator_py$")
    set_target_properties("${_target}" PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${Python3_INCLUDE_DIRS}")
  endif()
endforeach()
