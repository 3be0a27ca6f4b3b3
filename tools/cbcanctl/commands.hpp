// SPDX-License-Identifier: MIT
#pragma once

/// The commands of cbcanctl: each prints its result on standard output, or throws.

#include "cbcanctl/session.hpp"

namespace cbcan::ctl {

void read(const Options& options);
void write(const Options& options);
void nmt(const Options& options);
void state(const Options& options);
void emcy(const Options& options);
void kernel(const Options& options);
void configure(const Options& options);
void dump(const Options& options);
void scan(const Options& options);
void status(const Options& options);
void map(const Options& options);

}  // namespace cbcan::ctl
