//! Errors of labelling problems, each with the node or edge at fault.

/// Fault of a graph, of its costs or of an initial labelling.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MrfError {
    /// Graph with more nodes or edges than 30-bit indices hold.
    #[error("{nodes} nodes and {edges} edges, at most 2^30 of either")]
    TooLarge {
        /// Number of nodes.
        nodes: usize,
        /// Number of edges.
        edges: usize,
    },
    /// Edge with an end outside the graph.
    #[error("edge {edge}: node {node} of {nodes}")]
    EdgeOutOfRange {
        /// Index of the edge.
        edge: usize,
        /// Index of the missing node.
        node: u32,
        /// Number of nodes.
        nodes: usize,
    },
    /// Edge from a node to itself.
    #[error("edge {edge}: both ends are node {node}")]
    SelfLoop {
        /// Index of the edge.
        edge: usize,
        /// Index of the node.
        node: u32,
    },
    /// Other than one Potts weight per edge.
    #[error("{weights} weights for {edges} edges")]
    WeightCount {
        /// Number of weights.
        weights: usize,
        /// Number of edges.
        edges: usize,
    },
    /// Potts weight that is negative or not finite.
    #[error("edge {edge}: weight {weight} is not finite and at least 0")]
    InvalidWeight {
        /// Index of the edge.
        edge: usize,
        /// Weight at fault.
        weight: f32,
    },
    /// Number of labels other than the number of nodes.
    #[error("{labels} initial labels for {nodes} nodes")]
    LabelCount {
        /// Length of the initial labelling.
        labels: usize,
        /// Number of nodes.
        nodes: usize,
    },
    /// Unary table whose length is no positive multiple of the number of nodes.
    #[error("{unaries} unary costs for {nodes} nodes")]
    UnaryCount {
        /// Length of the unary table.
        unaries: usize,
        /// Number of nodes.
        nodes: usize,
    },
    /// Unary cost that is not finite.
    #[error("node {node}: unary cost of label {label} is not finite")]
    UnaryNotFinite {
        /// Index of the node.
        node: usize,
        /// Index of the label.
        label: usize,
    },
    /// Initial label outside the unary table.
    #[error("node {node}: initial label {label} of {labels}")]
    LabelOutOfRange {
        /// Index of the node.
        node: usize,
        /// Initial label.
        label: u32,
        /// Number of labels.
        labels: usize,
    },
}
