#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/voxelise/distance_field.hpp"

namespace phantom::slave_io {

/// Stores distance fields of earlier starts, each in a file together with its recipe, so that a restart only
/// has to read them. Another executable, cell or object has another recipe. Not thread-safe. Real-time safe:
/// no.
class FieldCache {
 public:
  /// Returns a text that contains everything a field is computed from, each number in full.
  static std::string recipe(const workspace::GridSpec& grid, const std::vector<voxelise::FieldBody>& bodies,
                            const voxelise::DistanceFieldOptions& options);

  /// The files are in `folder`, which is created with the first file.
  explicit FieldCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Returns the field of that recipe; none if it is not stored, or if its file is damaged, which is logged.
  std::optional<voxelise::DistanceField> find(const std::string& recipe) const;
  /// Stores the field and removes all but the kMostKept newest. Failures are logged; they only make the next
  /// start slow.
  void keep(const std::string& recipe, const voxelise::DistanceField& field) const;

  static constexpr std::size_t kMostKept = 6;

 private:
  std::filesystem::path file_of(const std::string& recipe) const;
  void remove_old() const;

  std::filesystem::path folder_;
};

}  // namespace phantom::slave_io
