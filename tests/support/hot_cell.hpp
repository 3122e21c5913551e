#pragma once

#include "common/runtime/cell/cell.hpp"

namespace phantom::test {

/// The shipped hot cell.
inline const runtime::CellConfig& hot_cell() {
  static const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  return cell;
}

}  // namespace phantom::test
