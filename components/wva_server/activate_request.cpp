#include "components/wva_server/activate_request.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "common/core/errors.hpp"

namespace phantom::wva_server {
namespace {

const char* const kExamples =
    "Examples:\n"
    "  A part in millimetres, six layers of four voxels, the file for ParaView:\n"
    "    wva_server activate --mesh part.stl --scale 0.001 --voxel-size-m 0.005 --layers 4,4,4,4,4,4 \\\n"
    "        --mu 32,20,13,11,10,9 --export part.nrrd\n"
    "  The same by the thesis's method, with a picture and how true its layers are:\n"
    "    wva_server activate --mesh part.stl --scale 0.001 --voxel-size-m 0.005 --layers 4,4,4,4,4,4 \\\n"
    "        --mu 32,20,13,11,10,9 --method dilation --element sphere-contained --export part.nrrd \\\n"
    "        --picture part.png --fidelity part.csv\n"
    "  A guard skin of two voxels, and three layers inside for a model larger than the real part:\n"
    "    … --guard 2 --inside 3 --mu-inside 40,60,80\n"
    "  A whole cell on two threads, its viscosities:\n"
    "    wva_server activate --cell deploy/cells/hot_cell/cell.yaml --threads 2 --field mu --export "
    "cell.nrrd";

void add_mesh_options(runtime::Command command, ActivateRequest& request) {
  command.option("--mesh", request.mesh, "mesh file to activate (STL, OBJ, PLY, OFF, glTF, COLLADA, …)");
  command
      .option("--scale", request.scale,
              "metres per unit of the mesh file, e.g. 0.001 for millimetres; "
              "default: what the file says, else a guess, which is reported")
      .between(1e-9, 1e9);
  command
      .option("--fit-extent-m", request.fit_extent_m,
              "scale the mesh so that its longest side has this length")
      .between(1e-6, 1e6);
  command
      .option(
          "--up-axis", request.up_axis,
          "axis of the mesh file that points up; default: what the file says, else a guess, which is reported")
      .one_of({"z", "y"});
  command.option("--pose", request.pose, "\"x y z roll pitch yaw\" of the mesh in W, metres and degrees");
  command
      .option("--voxel-size-m", request.voxel_size_m,
              "edge of a voxel, or its sides along x, y and z: 0.004,0.004,0.008")
      .separated_by(',')
      .between(1e-6, 1e3);
}

void add_layer_options(runtime::Command command, ActivateRequest& request) {
  command
      .option("--layers", request.layers, "thickness of each layer in voxels, the nearest first: 4,4,4,4,4,4")
      .separated_by(',');
  command.option("--mu", request.mu, "viscosity of each layer in Pa·s/m, falling outwards: 32,20,13,11,10,9")
      .separated_by(',');
  command
      .option("--mu-skin", request.mu_skin,
              "viscosity of the body itself; default 100, or the first layer's if higher")
      .between(1e-6, 1e6);
  command
      .option("--method", request.method,
              "how layers are made: distance (exact, between voxels; the default), surface (exact, to "
              "the mesh itself), "
              "dilation (the thesis's, voxel by voxel); with --cell in place of every object's own")
      .one_of({"distance", "surface", "dilation"});
  command
      .option("--element", request.element,
              "shaping element of the dilation method: cube, sphere (within m voxels; "
              "the default) or sphere-contained (within m and a half)")
      .one_of({"cube", "sphere", "sphere-contained"});
  command
      .option("--guard", request.guard,
              "thickness in voxels of a protective skin around the body, with layer 1's viscosity; "
              "the layers begin outside of it")
      .between(0, 254);
  command
      .option("--inside", request.inside,
              "layers inside the body, each as thick as layer 1, "
              "for a model that may be larger than the real part")
      .between(0, 98);
  command
      .option("--mu-inside", request.mu_inside,
              "their viscosities, rising inwards; default: in equal steps from layer 1's to the skin's")
      .separated_by(',');
}

/// Throws ConfigError if `file` is a folder or its folder does not exist.
void check_folder(const std::string& option, const std::string& file) {
  if (file.empty()) return;
  if (std::filesystem::is_directory(file))
    throw wrong_option(option, file + ": is a folder; allowed: a file name");
  const auto folder = std::filesystem::absolute(file).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw wrong_option(option, file + ": cannot be written: there is no folder " + folder.string());
}

}  // namespace

core::ConfigError wrong_option(const std::string& option, const std::string& problem) {
  return core::ConfigError("activate: " + option + ": " + problem);
}

void add_options(runtime::Command command, ActivateRequest& request) {
  add_mesh_options(command, request);
  command.option("--cell", request.cell, "cell file to activate as a whole, instead of a mesh");
  add_layer_options(command, request);
  command.option("--threads", request.threads, "threads to work on; default: the configuration's")
      .between(1, 1024);
  command.option("--export", request.out, "NRRD file to write").required();
  command.option("--field", request.field, "what to write per voxel; default: order")
      .one_of({"order", "mu", "object"});
  command.option("--encoding", request.encoding, "of the NRRD file; default: gzip").one_of({"gzip", "raw"});
  command.option("--picture", request.picture,
                 "PNG file to write: three sections through the middle of what is there, coloured by order");
  command.option("--fidelity", request.fidelity,
                 "file to write, .csv or .json: how far each layer's outer face lies from where it should, "
                 "by direction; of a mesh only");
  command.details(kExamples);
}

void check_request(const ActivateRequest& request) {
  // Checked here, before minutes of work.
  check_folder("--export", request.out);
  check_folder("--picture", request.picture);
  check_folder("--fidelity", request.fidelity);
  if (request.mesh.empty() == request.cell.empty())
    throw wrong_option("--mesh, --cell", "exactly one of them must be given");
  if (!request.fidelity.empty() && !request.fidelity.ends_with(".csv") &&
      !request.fidelity.ends_with(".json"))
    throw wrong_option("--fidelity",
                       "'" + request.fidelity + "'; allowed: a file name that ends with .csv or .json");
  if (!request.picture.empty() && !request.picture.ends_with(".png"))
    throw wrong_option("--picture", "'" + request.picture + "'; allowed: a file name that ends with .png");
  if (!request.cell.empty()) {
    const bool mesh_only = request.scale != 0 || request.fit_extent_m != 0 || !request.pose.empty() ||
                           !request.voxel_size_m.empty() || !request.layers.empty() || !request.mu.empty() ||
                           request.mu_skin != 0 || request.guard != 0 || !request.up_axis.empty() ||
                           request.inside != 0 || !request.mu_inside.empty() || !request.fidelity.empty();
    if (mesh_only) {
      throw wrong_option("--cell",
                         "the cell file says scale, up-axis, poses, voxel size, layers, viscosities, "
                         "guards and layers inside; allowed beside it: "
                         "--method, --element, --threads, --export, --field, --encoding, --picture");
    }
    return;
  }
  if (request.voxel_size_m.empty()) throw wrong_option("--voxel-size-m", "is missing; a mesh needs it");
  voxel_size_of(request);
  if (request.layers.empty() || request.mu.empty())
    throw wrong_option("--layers, --mu", "are missing; a mesh needs both");
  if (request.scale != 0 && request.fit_extent_m != 0)
    throw wrong_option("--scale, --fit-extent-m", "only one of them may be given");
  if (!request.mu_inside.empty() && request.mu_inside.size() != static_cast<std::size_t>(request.inside)) {
    throw wrong_option("--mu-inside", std::to_string(request.mu_inside.size()) +
                                          " viscosities for --inside " + std::to_string(request.inside) +
                                          "; allowed: one per layer inside");
  }
}

void apply_method(const ActivateRequest& request, workspace::LayerProfile& profile) {
  using workspace::LayerMethod, workspace::ShapingElement;
  if (!request.method.empty()) {
    profile.method = request.method == "surface"    ? LayerMethod::kSurface
                     : request.method == "dilation" ? LayerMethod::kDilation
                                                    : LayerMethod::kDistance;
  }
  if (request.element.empty()) return;
  if (profile.method != LayerMethod::kDilation)
    throw wrong_option("--element", "belongs to --method dilation; allowed: both or neither");
  profile.element = request.element == "cube"     ? ShapingElement::kCube
                    : request.element == "sphere" ? ShapingElement::kSphere
                                                  : ShapingElement::kSphereContained;
}

workspace::VoxelSize voxel_size_of(const ActivateRequest& request) {
  const std::vector<double>& sides_m = request.voxel_size_m;
  if (sides_m.size() != 1 && sides_m.size() != 3)
    throw wrong_option("--voxel-size-m",
                       "has " + std::to_string(sides_m.size()) + " numbers; allowed: one, or three, x,y,z");
  const workspace::VoxelSize size(
      Eigen::Vector3d(sides_m.front(), sides_m[sides_m.size() / 2], sides_m.back()));
  if (const core::Status checked = workspace::check_voxel_size(size); !checked)
    throw wrong_option("--voxel-size-m", checked.message());
  return size;
}

workspace::LayerProfile profile_of(const ActivateRequest& request) {
  workspace::LayerProfile profile;
  profile.thickness_vox = request.layers;
  profile.mu_Pa_s_per_m.assign(request.mu.begin(), request.mu.end());
  const double steepest = *std::max_element(request.mu.begin(), request.mu.end());
  const double skin = request.mu_skin != 0 ? request.mu_skin : std::max(100.0, steepest);
  profile.mu_skin_Pa_s_per_m = static_cast<float>(skin);
  profile.guard_vox = request.guard;
  profile.inside_thickness_vox.assign(static_cast<std::size_t>(request.inside), request.layers.front());
  profile.mu_inside_Pa_s_per_m.assign(request.mu_inside.begin(), request.mu_inside.end());
  for (int i = 1; request.mu_inside.empty() && i <= request.inside; ++i) {
    const double outer = request.mu.front();
    profile.mu_inside_Pa_s_per_m.push_back(
        static_cast<float>(outer + (skin - outer) * i / (request.inside + 1)));
  }
  apply_method(request, profile);
  if (const auto checked = workspace::check_profile(profile); !checked)
    throw wrong_option("--layers, --mu, --mu-skin, --guard, --inside, --mu-inside", checked.message());
  return profile;
}

std::string method_text(const workspace::LayerProfile& profile) {
  using workspace::LayerMethod, workspace::ShapingElement;
  if (profile.method == LayerMethod::kDistance) return "distance";
  if (profile.method == LayerMethod::kSurface) return "surface";
  return profile.element == ShapingElement::kCube     ? "dilation cube"
         : profile.element == ShapingElement::kSphere ? "dilation sphere"
                                                      : "dilation sphere-contained";
}

workspace::NrrdField field_of(const std::string& name) {
  return name == "mu"       ? workspace::NrrdField::kMu
         : name == "object" ? workspace::NrrdField::kObject
                            : workspace::NrrdField::kOrder;
}

}  // namespace phantom::wva_server
