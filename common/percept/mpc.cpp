#include "common/percept/mpc.hpp"

#include <cmath>
#include <numbers>

#include "common/core/text.hpp"

namespace phantom::percept {
namespace {

core::Status refuse(const std::string& what) {
  return core::Status::invalid_argument("multiple pass cylinder: " + what);
}

std::string number(double value) { return core::formatted("%g", value); }

bool positive(double value) { return std::isfinite(value) && value > 0.0; }

/// Returns γ at `distance` from the object, over gaps of the given widths, from the object outwards.
double gamma_along(const std::vector<double>& widths, const std::vector<double>& gamma, double distance,
                   MpcTransition transition) {
  double from = 0.0;
  for (std::size_t i = 0; i < widths.size(); from += widths[i++]) {
    if (distance >= from + widths[i]) continue;
    if (transition == MpcTransition::kStepped) return gamma[i];
    const double middle = from + 0.5 * widths[i];
    const bool outer_half = distance > middle;
    if (outer_half ? i + 1 == widths.size() : i == 0) return gamma[i];
    const std::size_t other = outer_half ? i + 1 : i - 1;
    const double share = std::abs(distance - middle) / (0.5 * (widths[i] + widths[other]));
    return gamma[i] + share * (gamma[other] - gamma[i]);
  }
  return 0.0;
}

}  // namespace

core::Status check_mpc(const MpcDesign& design) {
  if (!positive(design.cylinder_diameter_m))
    return refuse("a cylinder of diameter " + number(design.cylinder_diameter_m) + " m; allowed: above 0");
  if (!positive(design.fluid_viscosity_Pa_s))
    return refuse("a fluid of " + number(design.fluid_viscosity_Pa_s) + " Pa·s; allowed: above 0");
  if (design.pipes.empty()) return refuse("no pipes; allowed: at least one");
  for (std::size_t i = 0; i < design.pipes.size(); ++i) {
    const MpcPipe& pipe = design.pipes[i];
    const std::string name = "pipe " + std::to_string(i + 1);
    if (!positive(pipe.length_m))
      return refuse(name + " of length " + number(pipe.length_m) + " m; allowed: above 0");
    if (!positive(pipe.gap_m))
      return refuse(name + " with a gap of " + number(pipe.gap_m) + " m; allowed: above 0");
    if (!positive(pipe.diameter_m) || pipe.diameter_m > design.cylinder_diameter_m) {
      return refuse(name + " of diameter " + number(pipe.diameter_m) +
                    " m; allowed: above 0, up to the cylinder's " + number(design.cylinder_diameter_m) +
                    " m");
    }
  }
  return core::Status::ok();
}

double pipe_resistance_Pa_s_per_m3(const MpcPipe& pipe, double fluid_viscosity_Pa_s) {
  return 128.0 * fluid_viscosity_Pa_s * pipe.length_m / (std::numbers::pi * std::pow(pipe.diameter_m, 4));
}

std::vector<double> mpc_gamma_N_s_per_m(const MpcDesign& design) {
  const double area_m2 = std::numbers::pi * design.cylinder_diameter_m * design.cylinder_diameter_m / 4.0;
  std::vector<double> gamma;
  double conductance = 0.0;
  for (const MpcPipe& pipe : design.pipes) {
    conductance += 1.0 / pipe_resistance_Pa_s_per_m3(pipe, design.fluid_viscosity_Pa_s);
    gamma.push_back(area_m2 * area_m2 / conductance);
  }
  return gamma;
}

double mpc_gamma_at(const MpcDesign& design, double distance_m, MpcTransition transition) {
  std::vector<double> widths_m;
  for (const MpcPipe& pipe : design.pipes) widths_m.push_back(pipe.gap_m);
  return gamma_along(widths_m, mpc_gamma_N_s_per_m(design), distance_m, transition);
}

core::Expected<MpcLayers> mpc_layers(const MpcDesign& design, double voxel_size_m, MpcTransition transition) {
  if (core::Status checked = check_mpc(design); !checked) return checked;
  MpcLayers stepped;
  stepped.gamma_N_s_per_m = mpc_gamma_N_s_per_m(design);
  std::vector<double> widths_vox;
  double stroke_vox = 0.0;
  for (std::size_t i = 0; i < design.pipes.size(); ++i) {
    const double gap_vox = std::round(design.pipes[i].gap_m / voxel_size_m);
    if (gap_vox < 1.0 || gap_vox > 1e6) {
      return refuse("the gap of pipe " + std::to_string(i + 1) + ", " + number(design.pipes[i].gap_m) +
                    " m, is " + (gap_vox < 1.0 ? "less than half a voxel" : "more than a million voxels") +
                    " of " + number(voxel_size_m) + " m; allowed: whole voxels, at least 1");
    }
    stepped.thickness_vox.push_back(static_cast<int>(gap_vox));
    widths_vox.push_back(gap_vox);
    stepped.gap_m.push_back(gap_vox * voxel_size_m);
    stroke_vox += gap_vox;
  }
  if (transition == MpcTransition::kStepped) return stepped;
  MpcLayers fine;
  fine.gap_m = stepped.gap_m;
  for (int voxel = 0; voxel + 0.5 < stroke_vox; ++voxel) {
    const double gamma = gamma_along(widths_vox, stepped.gamma_N_s_per_m, voxel + 0.5, transition);
    if (!fine.gamma_N_s_per_m.empty() && gamma == fine.gamma_N_s_per_m.back()) {
      ++fine.thickness_vox.back();
      continue;
    }
    fine.thickness_vox.push_back(1);
    fine.gamma_N_s_per_m.push_back(gamma);
  }
  return fine;
}

}  // namespace phantom::percept
