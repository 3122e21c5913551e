#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

namespace phantom::geometry {

enum class UpAxis : std::uint8_t { kX, kY, kZ };

/// Where a value comes from: the caller's options, the file (or its format's standard), or a guess.
enum class KnownFrom : std::uint8_t { kCaller, kFile, kGuess };

/// Holds what a mesh file declares about its coordinates; empty where it declares nothing.
struct DeclaredFrame {
  std::optional<double> scale;  ///< metres per unit
  std::optional<UpAxis> up;
};

/// Holds a guess and its reason, worded for a warning.
struct UnitGuess {
  double scale = 1.0;  ///< metres per unit: 1 or 0.001
  std::string why;
};

/// Greatest extent, in m, that a guess accepts as plausible for an object of a manipulator's cell.
inline constexpr double kMaxPlausibleExtent_m = 20.0;

/// Guesses a mesh's unit: metres, or millimetres if the mesh would otherwise be larger than
/// kMaxPlausibleExtent_m. `extents`: of the mesh's box along x, y, z in its own units, finite. Pure; not
/// real-time safe.
UnitGuess guess_unit(const std::array<double, 3>& extents);

/// The units in which meshes are usually drawn, in metres: metres, centimetres, millimetres, inches.
inline constexpr std::array kUsualUnits{1.0, 1e-2, 1e-3, 0.0254};

/// Returns whether a text starts with one of these.
bool starts_with_any(std::string_view text, std::initializer_list<std::string_view> starts);

/// Guesses the up-axis that most tools use when they write this format. `format`: the importer's name for it.
UpAxis guess_up(std::string_view format);

/// Returns "metres" for 1, "millimetres" for 0.001 and so on; "0.3 m" for a scale without a name.
std::string unit_name(double scale);

/// Returns what the head of a text format declares: COLLADA's asset/unit/up_axis, AMF's and 3MF's unit
/// attribute, OpenGEX's metrics, DXF's $INSUNITS, depending on `format`. `head`: the first bytes of the file
/// or archive member, which may hold anything; the result is empty if nothing is understood. Pure; not
/// real-time safe.
DeclaredFrame declared_in_text(std::string_view format, std::string_view head);

/// Returns the name of a 3MF package's root model, from the text of its relationships (_rels/.rels); empty if
/// nothing is understood. Pure; not real-time safe.
std::string root_model_of_3mf(std::string_view relationships);

}  // namespace phantom::geometry
