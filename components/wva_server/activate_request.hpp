#pragma once

#include <string>
#include <vector>

#include "common/core/errors.hpp"
#include "common/runtime/process/command_line.hpp"
#include "common/workspace/grid.hpp"
#include "common/workspace/nrrd.hpp"
#include "common/workspace/profile.hpp"

namespace phantom::wva_server {

/// The arguments of `wva_server activate`, unchecked.
struct ActivateRequest {
  std::string mesh, cell;
  double scale = 0.0;                ///< m per mesh unit; 0: not given (from the file, or a guess)
  double fit_extent_m = 0.0;         ///< longest side after scaling; 0: not given
  std::string up_axis;               ///< "z", "y"; empty: not given (from the file, or a guess)
  std::string pose;                  ///< "x y z roll pitch yaw", m and degrees
  std::vector<double> voxel_size_m;  ///< one side, or one along each axis; empty: not given
  std::vector<int> layers;
  std::vector<double> mu;
  double mu_skin = 0.0;         ///< 0: not given
  std::string method, element;  ///< empty: not given
  int guard = 0;
  int inside = 0;
  std::vector<double> mu_inside;  ///< empty: not given
  int threads = 0;                ///< 0: not given (from the configuration)
  std::string out;
  std::string field = "order";
  std::string encoding = "gzip";
  std::string picture, fidelity;  ///< files to write; empty: none
};

/// Returns the error for `option` and its problem, to be thrown.
core::ConfigError wrong_option(const std::string& option, const std::string& problem);

/// Declares the subcommand's options on `command`.
void add_options(runtime::Command command, ActivateRequest& request);

/// Throws ConfigError if arguments are missing or do not go together; it names them and what is allowed.
void check_request(const ActivateRequest& request);

/// Returns the voxel size that a request for a mesh gives. Throws ConfigError.
workspace::VoxelSize voxel_size_of(const ActivateRequest& request);
/// Returns the profile that a request for a mesh describes. Throws ConfigError.
workspace::LayerProfile profile_of(const ActivateRequest& request);
/// Replaces the profile's method and element by the request's, where it gives them. Throws ConfigError for an
/// element without the dilation method.
void apply_method(const ActivateRequest& request, workspace::LayerProfile& profile);
/// Returns the method and element as text: "distance", "surface", "dilation sphere" …
std::string method_text(const workspace::LayerProfile& profile);
workspace::NrrdField field_of(const std::string& name);

}  // namespace phantom::wva_server
