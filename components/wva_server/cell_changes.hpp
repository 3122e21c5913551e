#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/cell/cell.hpp"

namespace phantom::wva_server {

/// The link of an arm that carries an object.
struct Carrier {
  std::string arm;      ///< its name in the cell file
  std::string frame;    ///< the arm's link that holds it
  geometry::Pose X_FO;  ///< object in the frame of that link
};

/// How an object differs from the cell file.
struct ObjectChange {
  std::uint16_t id = 0;
  std::string name;
  std::string description;  ///< YAML of an object that a command added; empty: it is in the cell file
  std::optional<geometry::Pose> X_WO;   ///< pose after a move; none: not moved
  std::optional<int> guard_vox;         ///< guard skin that a move set; none: not set
  bool removed = false;                 ///< true: the cell file's object was removed
  std::optional<Carrier> carrier = {};  ///< who carries it; none: nobody
};

/// The changes that commands made to a cell since its file was read: all that is needed to serve the same
/// cell again.
struct CellChanges {
  std::uint32_t next_id = 1;          ///< where the search for a free id begins
  std::vector<ObjectChange> objects;  ///< one per object that differs from the file, the latest change last

  void note_added(std::uint16_t id, const std::string& name, const std::string& description);
  void note_moved(std::uint16_t id, const std::string& name, const geometry::Pose& X_WO,
                  std::optional<int> guard_vox = {});
  void note_removed(std::uint16_t id, const std::string& name);
  void note_attached(std::uint16_t id, const std::string& name, const Carrier& carrier);
  /// Returns who carries an object of the cell: as commands left it, else as its file has it; none: nobody.
  /// Throws ConfigError if the file names an arm that is not there.
  std::optional<Carrier> carrier_of(const runtime::ObjectConfig& object,
                                    const runtime::CellConfig& cell) const;

 private:
  ObjectChange take(std::uint16_t id, const std::string& name);
};

/// Returns the link that holds what an arm carries unless something else is said: the last of its chain.
std::string last_link_of(const runtime::ArmConfig& arm);

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
