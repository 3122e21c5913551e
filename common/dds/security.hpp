#pragma once

#include <filesystem>
#include <string>

namespace eprosima::fastrtps::rtps {
class PropertyPolicy;
}

namespace phantom::dds {

/// Name of the folder with a participant's identity: what is no letter, digit, `_` or `-` in its name becomes
/// `_`.
std::string identity_name(const std::string& participant);

/// Adds what makes a participant take part in DDS Security with the documents in `folder`, as
/// deploy/security/make lays them out: authentication by PKI-DH, access control by signed permissions,
/// AES-GCM-GMAC. Throws MissingError naming the document that is missing or cannot be read.
void add_security(eprosima::fastrtps::rtps::PropertyPolicy& properties, const std::filesystem::path& folder,
                  const std::string& participant);

}  // namespace phantom::dds
