#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/cell.hpp"

namespace phantom::wva_server {

/// How an object differs from the cell file.
struct ObjectChange {
  std::uint16_t id = 0;
  std::string name;
  std::string description;             ///< YAML of an object that was added; empty: it is in the cell file
  std::optional<geometry::Pose> X_WO;  ///< where it was moved to
  std::optional<int> guard_vox;        ///< its guard skin, where a move gave it one
  bool removed = false;                ///< of an object in the cell file
};

/// What commands made of a cell since its file was read: all that is needed to serve it again as it was.
struct CellChanges {
  std::uint32_t next_id = 1;          ///< ids below it were given away
  std::vector<ObjectChange> objects;  ///< one for each that differs; the latest change last

  void note_added(std::uint16_t id, const std::string& name, const std::string& description);
  void note_moved(std::uint16_t id, const std::string& name, const geometry::Pose& X_WO,
                  std::optional<int> guard_vox = {});
  void note_removed(std::uint16_t id, const std::string& name);

 private:
  ObjectChange take(std::uint16_t id, const std::string& name);
};

/// The cell as its file has it, unchanged.
CellChanges no_changes(const runtime::CellConfig& cell);

/// Puts the changes into the cell's objects: those that changed stand last, the latest at the end. Throws
/// ConfigError if they do not fit the cell.
void apply(const CellChanges& changes, runtime::CellConfig& cell);

/// Keeps changes in `file` (JSON), for read_changes(). The file is whole at any time: the new one takes the
/// old one's place. Throws ConfigError if it cannot be written; the old one stays then.
void write_changes(const CellChanges& changes, const runtime::CellConfig& cell,
                   const std::filesystem::path& file);

/// What write_changes() kept; none if there is no file. Throws ConfigError if it is damaged, or if the cell
/// file is not the one that it was made for: then a person has to decide.
std::optional<CellChanges> read_changes(const runtime::CellConfig& cell, const std::filesystem::path& file);

}  // namespace phantom::wva_server
