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

/// Writes one field of the whole grid as an NRRD file that ParaView and 3D Slicer read. x runs fastest;
/// `space origin` is the centre of voxel (0,0,0) and `space directions` are the voxel's edges, both in W and
/// metres. A regular file is replaced only when the new one is complete. A path that exists and is not a
/// regular file (a pipe, a device) is written to directly. Not real-time safe.
core::Status write_nrrd(const std::filesystem::path& path, const Workspace& workspace, NrrdField field,
                        NrrdEncoding encoding = NrrdEncoding::kGzip);

}  // namespace phantom::workspace
