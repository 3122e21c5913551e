#pragma once

#include <urdf_parser/urdf_parser.h>

#include <filesystem>
#include <string>

// Reading of URDF files, for serial_arm_urdf.cpp alone.

namespace phantom::robot::detail {

/// An error in a URDF; SerialArm::from_urdf() turns it into a Status.
struct UrdfFault {
  std::string what;
  bool missing = false;  ///< a file is not there
};

/// Reads a URDF file. Throws a UrdfFault, without the file's name, for a file that urdfdom refuses, that
/// still has xacro in it, or whose links are not one tree. Nothing walks a model that is no tree.
urdf::ModelInterfaceSharedPtr read_urdf_file(const std::filesystem::path& file);

}  // namespace phantom::robot::detail
