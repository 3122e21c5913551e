#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "components/wva_server/config.hpp"

namespace CLI {
class App;
}

namespace phantom::wva_server {

/// Arguments of `wva_server activate`, as they were given.
struct ActivateRequest {
  std::string mesh, cell;
  double scale = 0.0;         ///< m per mesh unit; 0: not given (1)
  double fit_extent_m = 0.0;  ///< 0: not given
  std::string up_axis = "z";
  std::string pose;           ///< "x y z roll pitch yaw", m and degrees
  double voxel_size_m = 0.0;  ///< 0: not given
  std::vector<int> layers;
  std::vector<double> mu;
  double mu_skin = 0.0;  ///< 0: not given
  std::string method = "distance";
  std::string element;
  int guard = 0;
  int inside = 0;
  std::string out;
  std::string field = "order";
  std::string encoding = "gzip";
};

/// Declares the subcommand's options on `command`.
void add_options(CLI::App& command, ActivateRequest& request);

/// Activates a mesh or a cell without DDS, exports NRRD, prints one line of JSON on `print`. Returns the exit
/// code. Throws runtime::ConfigError for arguments and files that cannot be used, runtime::MissingError for a
/// missing mesh.
int run_activate(const ActivateRequest& request, const WvaServerConfig& config, std::ostream& print);

}  // namespace phantom::wva_server
