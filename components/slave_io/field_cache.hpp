#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/voxelise/distance_field.hpp"

namespace phantom::slave_io {

/// Distance fields of earlier starts, each in a file of its own beside everything it was made of. A restart
/// then takes as long as reading them. Another executable, cell or object makes another field. Not
/// thread-safe. Real-time safe: no.
class FieldCache {
 public:
  /// What a field is made of, each number in full.
  static std::string recipe(const workspace::GridSpec& grid, const std::vector<voxelise::FieldBody>& bodies,
                            const voxelise::DistanceFieldOptions& options);

  /// Files lie in `folder`, which is made when the first is kept.
  explicit FieldCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// The field of that recipe; none: it was not kept, or its file is damaged, which is logged.
  std::optional<voxelise::DistanceField> find(const std::string& recipe) const;
  /// Keeps the field and removes all but the kMostKept newest. What goes wrong is logged: the next start is
  /// slow, nothing else.
  void keep(const std::string& recipe, const voxelise::DistanceField& field) const;

  static constexpr std::size_t kMostKept = 6;

 private:
  std::filesystem::path file_of(const std::string& recipe) const;
  void remove_old() const;

  std::filesystem::path folder_;
};

}  // namespace phantom::slave_io
