// SPDX-License-Identifier: MIT
#include "protocols/http_site.hpp"

#include <exception>

#include "base/error.hpp"

namespace cbcan::protocols {

namespace {

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

/// Browsers take digits and dots for an IPv4 address, and no name has a colon.
bool is_number(std::string_view host) {
  return host.find_first_not_of("0123456789.") == std::string_view::npos ||
         host.find(':') != std::string_view::npos;
}

/// Any DNS server may give a name to this machine's address (DNS rebinding), so only known names are
/// accepted; an IP address is safe. Empty = not refused.
std::string refusal(const HttpSite& site, const HttpRequest& request) {
  std::string name;
  try {
    name = base::parse_listen_address(request.host, 80).host;
  } catch (const base::UsageError&) {
    return "a request without a Host header that can be read";
  }
  if (!is_number(name) && name != "localhost" && name != site.name)
    return "Host is " + name + ": use the address of this machine";
  if (!request.origin.empty() && request.origin != "http://" + request.host)
    return "pages of " + request.origin + " may not ask here";
  if (request.method == "POST" && !site.may_write())
    return "read-only, as other machines reach " + to_string(site.address) + "; http.write allows it";
  return {};
}

}  // namespace

bool HttpSite::may_write() const {
  return write || is_loopback(address.host);
}

HttpResponse HttpSite::respond(const HttpRequest& request, bool too_long) const try {
  if (const std::string refused = refusal(*this, request); !refused.empty())
    return {403, "text/plain", refused + "\n"};
  if (too_long) return {413, "text/plain", "a body of more than 64 KiB\n"};
  if (request.method != "GET" && request.method != "POST") return {405, "text/plain", "GET or POST\n"};
  return handle(request);
} catch (const std::exception& error) {
  return {500, "text/plain", std::string(error.what()) + "\n"};
}

}  // namespace cbcan::protocols
