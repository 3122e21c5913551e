#pragma once

#include <filesystem>

#include "common/core/status.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

enum class NrrdField {
  kOrder,   ///< int8: 0 free, 1…q neighbour layers, 99 guard, 100 boundary, 101 interior
  kMu,      ///< float, Pa·s/m
  kObject,  ///< uint16, 0 where free
};

enum class NrrdEncoding { kRaw, kGzip };

/// Writes one field of the whole grid as NRRD (x fastest; `space origin` is the centre of voxel (0,0,0),
/// `space directions` the voxel's edges, both in W and metres), as ParaView and 3D Slicer read it. The file
/// appears whole or not at all; what is there and no file (a pipe, a device) is written to. Not real-time
/// safe.
core::Status write_nrrd(const std::filesystem::path& path, const Workspace& workspace, NrrdField field,
                        NrrdEncoding encoding = NrrdEncoding::kGzip);

}  // namespace phantom::workspace
