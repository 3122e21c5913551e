#pragma once

// Private to this library and to its importer: how the importer's outcome goes through a pipe.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "common/geometry/mesh_io.hpp"

namespace phantom::geometry::detail {

/// The outcome as bytes: a head with counts, a text (the problem; or the format's name and the notes, a line
/// each), then what mesh_bytes() gives. Between two programs of one build on one machine. This is all of it
/// but the last, which need not be copied to be sent.
std::vector<std::uint8_t> answer_head(const LoadedMesh& mesh);
/// Likewise, that there is no mesh, and why; nothing follows.
std::vector<std::uint8_t> refusal(std::string_view problem);

/// Most bytes that an answer within the options' limits has.
std::size_t max_answer_bytes(const MeshImportOptions& options);

/// Back from either, whole. Nothing in the bytes is believed: counts must account for every byte and keep to
/// the limits, indices lie within the vertices, coordinates and scale be finite, else kInternal. The
/// importer's refusal is kInvalidArgument. Messages are without the file's name.
core::Expected<LoadedMesh> mesh_of_answer(std::span<const std::uint8_t> bytes,
                                          const MeshImportOptions& options);

}  // namespace phantom::geometry::detail
