#pragma once

#include <httplib.h>
#undef _res  // a macro of resolv.h, which httplib.h includes: a name of Eigen's

#include <string>

#include "common/web/request_origin.hpp"

namespace phantom::web {

/// Gives a page's server what all its answers have in common: nothing is cached or guessed, and errors are
/// answered as JSON. `who` could not answer where a handler has thrown, such as "the viewer".
void set_common_answers(httplib::Server& server, const std::string& who);

/// Returns the headers of a request by which it is known where it comes from.
RequestOrigin origin_of(const httplib::Request& request);

/// Returns why a request that changes something is refused: it is no JSON, which a page from elsewhere cannot
/// send without asking first, or comes from elsewhere. Empty if it is not refused.
std::string command_refusal(const OriginRule& rule, const httplib::Request& request);

}  // namespace phantom::web
