# Included after the find_package calls of an interface package, before rosidl_generate_interfaces.

# ROS 2 wheels export targets that name the Python include folder of the machine they were built on. CMake
# refuses targets with folders that do not exist, so this machine's folder takes their place.
find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Module)
get_property(_imported_targets DIRECTORY PROPERTY IMPORTED_TARGETS)
foreach(_target IN LISTS _imported_targets)
  if(_target MATCHES "__rosidl_generator_py$")
    set_target_properties("${_target}" PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${Python3_INCLUDE_DIRS}")
  endif()
endforeach()

# Only what rclpy over Fast DDS loads is generated and compiled: the C messages, their type supports for Fast DDS
# (serialization) and introspection (the type that Fast DDS announces), and the Python extension. The C++ messages and
# the type supports for C++ would take half of the time, and nothing in the environment loads them.
#
# The generators run as extensions of rosidl_generate_interfaces; finding a package registers its generator.
list(FILTER AMENT_EXTENSIONS_rosidl_generate_idl_interfaces EXCLUDE REGEX "_cpp:")

# Python loads the extension of rosidl_typesupport_c; those of the type supports behind it are never imported.
macro(rosidl_generator_py_get_typesupports names)
  set(${names} rosidl_typesupport_c)
endmacro()

# Hundreds of small files include the same headers, and reading these is nearly all of the compiler's work: compile
# each library as one file. Descriptions define static names that clash, so they stay by themselves.
function(compile_each_library_at_once)
  get_target_property(_sources ${PROJECT_NAME}__rosidl_generator_c SOURCES)
  list(FILTER _sources INCLUDE REGEX "__description\\.c$")
  set_source_files_properties(${_sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  foreach(_library rosidl_generator_c rosidl_typesupport_fastrtps_c rosidl_typesupport_introspection_c
      rosidl_typesupport_c rosidl_generator_py)
    set_target_properties(${PROJECT_NAME}__${_library} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)
  endforeach()
endfunction()
cmake_language(DEFER CALL compile_each_library_at_once)
