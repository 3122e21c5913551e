#pragma once

// Codecs of the topics of idl/workspace.idl: from_idl(), read() and to_idl() of each.

#include "phantom_contract/workspace_codec.hpp"
