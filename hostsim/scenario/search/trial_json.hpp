// SPDX-License-Identifier: MIT
#pragma once

/// Trials of --explore as JSON: between processes, and in the file of --state.

#include <nlohmann/json.hpp>

#include "scenario/search/trial.hpp"

namespace cbcan::search {
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Result, verdict, what, seen, during, request, said, happened, reached,
                                   frames, duration)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Record::Transaction, text, value, matches)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Record, transactions, matches, changing, unrequested, nodes, readable,
                                   frames, requests, duration)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(TrialReport, result, record, problem, is_usage)
}  // namespace cbcan::search
