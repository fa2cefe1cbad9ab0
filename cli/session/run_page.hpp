#pragma once

namespace edgewise::cli {

class TypedRequest;

/// Writes --report: the page of a run that has ended well. Without Graphviz it says so in place of
/// the graph. @throws RunError, Cancelled
void write_run_page(const TypedRequest& typed);

}  // namespace edgewise::cli
