#pragma once

#include <vector>

#include "common/core/status.hpp"

namespace phantom::percept {

/// One of the parallel bypass pipes of a multiple pass cylinder.
struct MpcPipe {
  double diameter_m = 0.0;  ///< d_i
  double length_m = 0.0;    ///< l_i
  double gap_m = 0.0;  ///< G_i: the part of the stroke on which exactly this pipe and those before it in the
                       ///< list are open
};

/// A multiple pass cylinder (spec 1.1, thesis eqs. 3.1–3.11 with the spec's errata). A piston pushes fluid
/// out through bypass pipes, which close one after the other. So the piston meets more resistance the nearer
/// it comes to the cylinder's end, which touches the object.
struct MpcDesign {
  double cylinder_diameter_m = 0.0;   ///< D
  double fluid_viscosity_Pa_s = 0.0;  ///< μ_f
  std::vector<MpcPipe> pipes;         ///< first the one next to the object, which stays open longest
};

enum class MpcTransition {
  kStepped,      ///< γ changes where a pipe closes
  kInterpolated  ///< γ_i holds in the middle of its gap; between the middles γ is linear
};

/// The layers that a piston meets, from the object outwards.
struct MpcLayers {
  std::vector<int> thickness_vox;
  std::vector<double> gamma_N_s_per_m;  ///< decreasing; as many as thickness_vox
  std::vector<double> gap_m;            ///< of each pipe, rounded to whole voxels
};

/// Checks whether the design can be built; the message says what is wrong and what is allowed.
core::Status check_mpc(const MpcDesign& design);

/// Returns the flow resistance of a pipe in laminar flow (Hagen–Poiseuille): ρ = 128 μ_f l / (π d⁴), Pa·s/m³.
double pipe_resistance_Pa_s_per_m3(const MpcPipe& pipe, double fluid_viscosity_Pa_s);

/// Returns γ_1 … γ_n for 1 … n open pipes: γ_n = A² / Σ_{i ≤ n} 1/ρ_i, N·s/m. The opposing force is F = v·γ.
/// The design must have been checked.
std::vector<double> mpc_gamma_N_s_per_m(const MpcDesign& design);

/// Returns γ at a distance from the object along the stroke; 0 beyond the stroke. The design must have been
/// checked.
double mpc_gamma_at(const MpcDesign& design, double distance_m, MpcTransition transition);

/// Converts the design to whole voxels: gap i becomes k_i = G_i / voxel size voxels, rounded. With
/// kInterpolated, every voxel along the stroke gets its own layer, with γ at the middle of the voxel;
/// neighbours with the same γ share a layer. Refuses a design that cannot be built, and a gap of less than
/// half a voxel.
core::Expected<MpcLayers> mpc_layers(const MpcDesign& design, double voxel_size_m, MpcTransition transition);

}  // namespace phantom::percept
