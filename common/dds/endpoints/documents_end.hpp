#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"

namespace phantom::dds {

/// The document of DDS Security that ends first.
struct DocumentsEnd {
  std::filesystem::path document;
  core::Nanoseconds utc_ns = 0;  ///< when it ends
};

/// Returns which of the documents of `participant` in `folder` ends first: its certificate, its permissions,
/// or an authority's certificate. Nothing if none of them can be read. Once one has ended, the participant is
/// admitted by nobody who does not know it yet. Not real-time safe.
std::optional<DocumentsEnd> documents_end(const std::filesystem::path& folder,
                                          const std::string& participant);

/// Time before their end from which documents are reported.
inline constexpr core::Nanoseconds kDocumentsMargin_ns = 30 * 86'400 * core::kNsPerSecond;

/// Adds to a status that documents end within kDocumentsMargin_ns of `utc_ns`, or have ended: a sentence and
/// the figure "security_days_left".
void add_documents_end(core::Health& health, const DocumentsEnd& end, core::Nanoseconds utc_ns);

}  // namespace phantom::dds
