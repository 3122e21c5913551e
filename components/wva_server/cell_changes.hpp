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
  std::string description;  ///< YAML of an object that a command added; empty: it is in the cell file
  std::optional<geometry::Pose> X_WO;  ///< pose after a move; none: not moved
  std::optional<int> guard_vox;        ///< guard skin that a move set; none: not set
  bool removed = false;                ///< true: the cell file's object was removed
};

/// The changes that commands made to a cell since its file was read: all that is needed to serve the same
/// cell again.
struct CellChanges {
  std::uint32_t next_id = 1;          ///< all ids below it are used up
  std::vector<ObjectChange> objects;  ///< one per object that differs from the file, the latest change last

  void note_added(std::uint16_t id, const std::string& name, const std::string& description);
  void note_moved(std::uint16_t id, const std::string& name, const geometry::Pose& X_WO,
                  std::optional<int> guard_vox = {});
  void note_removed(std::uint16_t id, const std::string& name);

 private:
  ObjectChange take(std::uint16_t id, const std::string& name);
};

/// Returns the changes of a cell that is as its file has it: none.
CellChanges no_changes(const runtime::CellConfig& cell);

/// Applies the changes to the cell's objects. Changed objects come last, the latest change at the end. Throws
/// ConfigError if the changes do not fit the cell.
void apply(const CellChanges& changes, runtime::CellConfig& cell);

/// Writes the changes to `file` as JSON, for read_changes(). A new file replaces the old one in one step, so
/// that the file is complete at any time. Throws ConfigError if it cannot be written; the old file stays
/// then.
void write_changes(const CellChanges& changes, const runtime::CellConfig& cell,
                   const std::filesystem::path& file);

/// Reads the changes that write_changes() wrote; none if there is no file. Throws ConfigError if the file is
/// damaged, or if the cell file is not the one for which it was written: a person has to decide then.
std::optional<CellChanges> read_changes(const runtime::CellConfig& cell, const std::filesystem::path& file);

}  // namespace phantom::wva_server
