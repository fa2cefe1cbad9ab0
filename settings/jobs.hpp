#pragma once

#include "graph/job.hpp"
#include "graph/radon.hpp"

/// Which jobs have a setting.
namespace edgewise::has {

inline bool any(Job) { return true; }
inline bool render(Job job) { return job == Job::render; }
inline bool warp(Job job) { return job == Job::warp; }
inline bool mesh(Job job) { return job == Job::mesh; }
inline bool filter(Job job) { return job == Job::filter; }
inline bool radon(Job job) { return job == radon_job(); }
inline bool neither_mesh(Job job) { return !mesh(job); }
/// A result that is seen from somewhere.
inline bool views(Job job) { return render(job) || warp(job); }

}  // namespace edgewise::has
