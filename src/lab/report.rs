//! Reports: pages and tables made from records. Nothing here changes a result.
