#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace phantom::dds {

/// Returns the name of the folder with a participant's identity: every character of its name that is not a
/// letter, digit, `_` or `-` becomes `_`.
std::string identity_name(const std::string& participant);

/// Returns the properties, names and values, that enable DDS Security for a participant with the documents in
/// `folder`, as deploy/security/make lays them out: authentication by PKI-DH, access control by signed
/// permissions, AES-GCM-GMAC. Throws MissingError naming the document that is missing or cannot be read.
std::vector<std::pair<std::string, std::string>> security_properties(const std::filesystem::path& folder,
                                                                     const std::string& participant);

}  // namespace phantom::dds
