// SPDX-License-Identifier: MIT
// Host names by these two services, which glibc has inside. Others that nsswitch.conf names would be loaded as shared libraries, and abort the
// program where glibc has another version. The linker's warnings about getaddrinfo mean these.
#include <nss.h>

namespace {

[[maybe_unused]] const int services = __nss_configure_lookup("hosts", "files dns");

}  // namespace
