#pragma once

#include <string>
#include <vector>

#include "common/core/errors.hpp"
#include "common/runtime/command_line.hpp"
#include "common/workspace/nrrd.hpp"
#include "common/workspace/profile.hpp"

namespace phantom::wva_server {

/// Arguments of `wva_server activate`, as they were given.
struct ActivateRequest {
  std::string mesh, cell;
  double scale = 0.0;         ///< m per mesh unit; 0: not given (the file's, or a guess)
  double fit_extent_m = 0.0;  ///< 0: not given
  std::string up_axis;        ///< "z", "y"; empty: not given (the file's, or a guess)
  std::string pose;           ///< "x y z roll pitch yaw", m and degrees
  double voxel_size_m = 0.0;  ///< 0: not given
  std::vector<int> layers;
  std::vector<double> mu;
  double mu_skin = 0.0;         ///< 0: not given
  std::string method, element;  ///< empty: not given
  int guard = 0;
  int inside = 0;
  std::vector<double> mu_inside;  ///< empty: not given
  int threads = 0;                ///< 0: not given (the configuration's)
  std::string out;
  std::string field = "order";
  std::string encoding = "gzip";
  std::string picture, fidelity;  ///< files to write; empty: none
};

/// What to throw for `option`, named with its problem.
core::ConfigError wrong_option(const std::string& option, const std::string& problem);

/// Declares the subcommand's options on `command`.
void add_options(runtime::Command command, ActivateRequest& request);

/// Refuses arguments that are missing or do not go together. Throws ConfigError that names them and what is
/// allowed.
void check_request(const ActivateRequest& request);

/// The profile that the request for a mesh describes. Throws ConfigError.
workspace::LayerProfile profile_of(const ActivateRequest& request);
/// Puts the request's method and element, where it names them, in place of the profile's own. Throws
/// ConfigError for an element without the dilation method.
void apply_method(const ActivateRequest& request, workspace::LayerProfile& profile);
/// "distance", "surface", "dilation sphere" …
std::string method_text(const workspace::LayerProfile& profile);
workspace::NrrdField field_of(const std::string& name);

}  // namespace phantom::wva_server
