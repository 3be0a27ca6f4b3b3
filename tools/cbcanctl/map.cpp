// SPDX-License-Identifier: MIT
#include <iostream>

#include "base/words.hpp"
#include "cbcanctl/commands.hpp"
#include "cbcanctl/tag_forms.hpp"

namespace cbcan::ctl {

void map(const Options& options) {
  if (!options.form) throw tools::UsageError("--for is missing: " + base::listed(tools::kForms));
  if (options.json) throw tools::UsageError("--json: leave it out; --for csv is for programs");
  const std::vector<tools::Tag> tags = tools::tags_of(read_network(options.network));
  std::cout << tools::text_of(*options.form, tags, options.at,
                              {options.target.host, static_cast<std::uint16_t>(options.target.port)});
}

}  // namespace cbcan::ctl
